"""`groundstation forecast`: printed and written output, and operator mistakes."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from groundstation.cli import main as cli
from groundstation.cli.exits import ExitCode
from groundstation.forecast import forecast as parts
from groundstation.forecast.stands import StandSearch


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "_CELLS", 12)
    monkeypatch.setattr(parts, "_PATH_PLACES", 3)


def test_a_page_is_printed_in_eighty_columns_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "forecast.html"
    assert cli.run(["forecast", "lab", "--path", "0,0 3.9,2.9", "-o", str(page)]) == ExitCode.OK
    text = capsys.readouterr().out
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80
    blind = "on the path: 1 of 3 places, first at (3.9, 2.9): whoever sees it is out of the view of ceiling"
    assert blind in " ".join(text.split())
    assert "without ceiling there is no tracking" in text
    assert "drone_1  10 min at most, until it lands at 15%" in text
    assert "as before the flight: ceiling: x, y, z, yaw, roll_error, pitch_error" in text
    written = page.read_text(encoding="utf-8")
    assert "<svg" in written
    assert not any(word in written for word in ("src=", "<script", "<link", 'href="http')), "it needs no network"
    assert "<th>not seen</th>" in written


def test_json_has_all_figures_and_pictures_are_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "map.svg"
    assert cli.run(["forecast", "lab", "--scenario", "realistic", "--json", "-o", str(picture)]) == ExitCode.OK
    found = json.loads(capsys.readouterr().out)
    assert len(found["floor"]["places"]) * len(found["floor"]["x_m"]) == 12
    assert {one["reason"] == "" for row in found["floor"]["places"] for one in row if one["std_m"]} == {True}
    assert found["path"]["blind_share"] == 0.0
    assert 0.02 < found["path"]["worst_m"] < 0.08
    assert found["failures"]["ceiling"]["unlocalised"] == ["drone_1", "drone_2", "turtlebot"]
    assert found["observability"][0]["entries"]["ceiling.yaw"]["after"] > 0.0
    assert found["battery"] == {"drone_1": pytest.approx(612.0), "drone_2": pytest.approx(612.0)}
    assert picture.read_text(encoding="utf-8").count("<path") > 20


def test_places_whose_stand_the_planner_would_leave_are_counted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    planned = StandSearch._planned
    monkeypatch.setattr(StandSearch, "_planned", lambda *given: replace(planned(*given), placed=frozenset()))
    assert cli.run(["forecast", "lab", "--path", "0,0 3.9,2.9"]) == ExitCode.OK
    told = " ".join(capsys.readouterr().out.split())
    assert "on the path: at 2 of the 2 places that are seen the planner alone would leave the stand" in told


def test_warnings_about_the_field_come_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plane = "ranging.uwb.anchors={a: [-3, -2, 2], b: [3, -2, 2], c: [3, 2, 2], d: [-3, 2, 2]}"
    page, words = tmp_path / "forecast.html", "lie nearly in one plane"
    assert cli.run(["forecast", "uwb-lab", "--set", plane, "-o", str(page)]) == ExitCode.OK
    text = capsys.readouterr().out
    assert text.startswith("WARNING: ") and words in " ".join(text.split())
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80
    written = page.read_text(encoding="utf-8")
    assert written.index("WARNING: ") < written.index("<h2>") and words in written
    assert cli.run(["forecast", "uwb-lab", "--set", plane, "--json"]) == ExitCode.OK
    (warning,) = json.loads(capsys.readouterr().out)["warnings"]
    assert words in warning


def test_each_of_several_targets_is_forecast_by_itself(capsys: pytest.CaptureFixture[str]) -> None:
    order = ["forecast", "two-targets", "--scenario", "parting-targets"]
    assert cli.run(order) == ExitCode.OK
    assert "as if turtlebot_2 were not there: --target forecasts others" in capsys.readouterr().out
    assert cli.run([*order, "--target", "turtlebot_2", "--json"]) == ExitCode.OK
    found = json.loads(capsys.readouterr().out)
    assert found["target"] == "turtlebot_2" and "turtlebot_2" in found["failures"]["ceiling"]["unlocalised"]
    assert found["path"]["places"][0]["place_m"] == [0.0, -0.3], "it goes along its own path"


@pytest.mark.parametrize(
    ("given", "answer"),
    [
        (["--path", "0,0 1;2"], "--path: '1;2' is no place; a path looks like '-2,0 2,0 2,1': places x,y [m; world]"),
        (["--path", "nan,0"], "--path: 'nan,0' is no place"),
        (["--path", " "], "--path: names no place"),
        (["--path", "0,0 9,0"], "--path: the path of turtlebot leaves the room: up to x 9.0, y 0.0 m"),
        (["--path", "0,0", "--scenario", "realistic"], "--path and --scenario both name a path: give one of them"),
        (["--target", "bot"], "--target: the field has no target 'bot'; it has turtlebot"),
        (["-o", "map.txt"], "--output map.txt: must end in .svg, .png, .pdf or .html"),
    ],
)
def test_mistakes_are_answered_with_place_and_remedy(
    given: list[str], answer: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["forecast", "lab", *given]) == ExitCode.SETTINGS
    assert answer in capsys.readouterr().err

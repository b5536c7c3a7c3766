"""Errors left in a field after settings change, and the judgement of a flight with corrected settings."""

import json
from pathlib import Path
from typing import Any

import pytest

from groundstation.calibration.team_left import errors_left
from groundstation.calibration.team_settings import with_changes
from groundstation.cli.main import run
from groundstation.experiments.calibrations import calibrated_labs, row_of, table, verdict_on
from groundstation.experiments.culprit_rows import WrongLab, labs_of
from groundstation.experiments.flight_batches import FlightBatch
from groundstation.field.resolved import ResolvedField
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from sim_bridge.study.wrong_figures import WrongFigures

TURNED = WrongLab("pan of one", (("drone_1", "pan", 3.0),))
LATE = WrongLab("ceiling's pictures", (("ceiling", "delay", 50.0),))


@pytest.fixture(scope="module")
def lab() -> ResolvedField:
    return resolved_field(load_field(find_field("lab")))


@pytest.mark.parametrize(
    ("error", "path", "value", "left"),
    [
        (("drone_1", "pan", 3.0), ("drones", "drone_1", "camera", "pan_left_deg"), 2.9, 0.1),
        (("drone_1", "up", 0.02), ("drones", "drone_1", "camera", "position_m"), [0.09, 0.0, 0.015], 0.005),
        (("ceiling", "delay", 50.0), ("cameras", "ceiling", "video_delay_ms"), 166.0, 4.0),
        (("ceiling", "roll", 3.0), ("cameras", "ceiling", "rotation_deg"), [2.8, 0.0, 0.0], 0.2),
        (("drone_2", "print", 0.05), ("drones", "drone_2", "marker", "square_mm"), 46.2, 0.0),
        (("turtlebot", "print", 0.05), ("target", "marker", "square_mm"), 44.44, 1.05 / 1.01 - 1.0),
    ],
)
def test_a_corrected_setting_leaves_only_the_remaining_error(
    lab: ResolvedField, error: tuple[str, str, float], path: tuple[str, ...], value: Any, left: float
) -> None:
    found = {(who, part): size for who, part, size in errors_left([error], lab, with_changes(lab, {path: value}))}
    assert found.pop(error[:2], 0.0) == pytest.approx(left, abs=1e-9)
    assert all(abs(size) < 1e-9 for size in found.values())


def test_a_setting_that_was_right_and_is_changed_is_wrong_then(lab: ResolvedField) -> None:
    new = with_changes(lab, {("cameras", "ceiling", "video_delay_ms"): 130.0})
    assert errors_left([], lab, new) == (("ceiling", "delay", -10.0),)
    assert errors_left(TURNED.errors, lab, lab) == TURNED.errors


def test_the_room_stays_the_same_when_the_field_file_is_mended(lab: ResolvedField) -> None:
    before = WrongFigures({("ceiling", "yaw"): 3.0, ("drone_1", "pan"): 3.0})
    new = with_changes(
        lab,
        {("cameras", "ceiling", "rotation_deg"): [0.1, 0.0, 2.7], ("drones", "drone_1", "camera", "pan_left_deg"): 2.0},
    )
    errors = [(who, part, size) for (who, part), size in before.errors.items()]
    after = WrongFigures({(who, part): size for who, part, size in errors_left(errors, lab, new)})
    true, again = before.world(lab), after.world(new)
    assert again.cameras["ceiling"].rotation_deg == pytest.approx(true.cameras["ceiling"].rotation_deg)
    assert again.drones["drone_1"].camera.pan_left_deg == pytest.approx(true.drones["drone_1"].camera.pan_left_deg)


def flight(rmse_m: float, anees: float, **left: float) -> dict[str, Any]:
    cameras = {"drone_1": {"turn": 3.0} | left, "ceiling": {"delay": 50.0} | left}
    return {"seed": 1, "settings": [], "rmse_m": rmse_m, "anees": anees, "left": cameras}


def test_a_flight_is_mended_by_rmse_and_anees_and_its_figure_by_its_own_bar() -> None:
    good = verdict_on(TURNED, flight(0.09, 8.0), flight(0.03, 1.1, turn=0.2))
    assert good["mended"] and good["missed"] == [] and good["left"] == {"drone_1 turn": 0.2}
    assert not verdict_on(TURNED, flight(0.09, 8.0), flight(0.05, 1.1, turn=0.2))["mended"]
    assert not verdict_on(TURNED, flight(0.09, 8.0), flight(0.03, 2.4, turn=0.2))["mended"]
    late = verdict_on(LATE, flight(0.04, 2.0), flight(0.02, 1.0, delay=-6.0))
    assert late["mended"] and late["missed"] == ["ceiling delay"]
    fell = verdict_on(LATE, flight(0.04, 2.0), {"seed": 1, "left": {"ceiling": {"delay": 0.0}}, "anees": None})
    assert not fell["mended"]
    lines = table([row_of(TURNED, [good]), row_of(LATE, [late, fell])])
    assert "1/1" in lines[1] and "0.090 -> 0.030" in lines[1] and "drone_1 turn 0.20 deg" in lines[1]
    assert "1/2" in lines[2] and "ceiling delay -6.00 ms" in lines[2]
    assert "0.040 -> never" in lines[2] and "2.0 -> never" in lines[2], "the worst flight is the one that never found"
    assert row_of(LATE, [late, fell])["rmse_m"] == [0.04, None]


def test_rows_are_those_whose_field_file_alone_is_wrong() -> None:
    names = {"cameras": {"ceiling": {}}, "drones": {"a": {}, "b": {}}, "target": {"name": "rover"}}
    found = [one.name for one in calibrated_labs(labs_of(names))]
    assert found[0] == "nothing" and {"pan of both", "all markers", "a drone's lens", "ceiling aside"} <= set(found)
    assert not {"a wrong pad", "markers exchanged", "ceiling bumped", "a drone's telemetry"} & set(found)


def test_proposed_settings_are_written_into_the_field_and_flown_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    flown: list[dict[str, Any]] = []

    def fly(batches: list[FlightBatch], *_: object) -> list[dict[str, Any]]:
        rows = []
        for batch in batches:
            order = json.loads(batch.order) | {"seeds": batch.seeds}
            flown.append(order)
            turn = sum(size for who, part, size in order["errors"] if (who, part) == ("drone_1", "pan"))
            found = flight(0.09 if turn > 1.0 else 0.02, 1.0, turn=turn) | {"seed": batch.seeds[0]}
            found["settings"] = [[["drones", "drone_1", "camera", "pan_left_deg"], 2.9]] if order["calibrate"] else None
            rows.append({"merits": {"flights": [found]}, "timing": {"flights": [{}]}})
        return rows

    monkeypatch.setattr("groundstation.cli.experiment_calibrations.fly_all", fly)
    asked = ["experiment", "calibrations", "--rows", "pan of one", "--seeds", "2", "--seed", "7", "-o", str(tmp_path)]
    assert run(asked) == 0
    first, second, again, last = flown
    assert [one["calibrate"] for one in flown] == [True, True, False, False]
    assert (first["seeds"], second["seeds"]) == (again["seeds"], last["seeds"]) == ((7,), (8,))
    assert first["errors"] == [["drone_1", "pan", 3.0]]
    assert again["errors"] == [["drone_1", "pan", pytest.approx(0.1)]]
    assert again["field"]["drones"]["drone_1"]["camera"]["pan_left_deg"] == 2.9
    assert "2/2" in capsys.readouterr().out and (tmp_path / "calibrations.json").exists()

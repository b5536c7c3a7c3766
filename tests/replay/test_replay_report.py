"""Reports mark a re-run as such and never judge it as a flight."""

import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from groundstation.cli.main import groundstation

CHANGE = "planner.horizon_steps=3"


def done(*arguments: object) -> str:
    """Return the output of a command that must end with exit code 0."""
    result = CliRunner().invoke(groundstation, [*map(str, arguments)], standalone_mode=False)
    assert result.exception is None, result.output
    assert int(result.return_value or 0) == 0, result.output
    return result.output


KINDS = {"re-run": ("--recompute",), "what-if": ("--set", CHANGE)}


@pytest.fixture(scope="module")
def flight(flown: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the flight, since reports are written into its folder."""
    return Path(shutil.copytree(flown, tmp_path_factory.mktemp("reported") / "flight"))


@pytest.fixture(scope="module", params=KINDS)
def rerun(request: pytest.FixtureRequest, flight: Path) -> tuple[Path, str]:
    """Return the folder of a re-run, and its expected name."""
    folder = flight.parent / str(request.param)
    done("replay", flight, *KINDS[request.param], "--output", folder)
    return folder, str(request.param)


def test_its_report_says_so_and_judges_nothing(rerun: tuple[Path, str], flight: Path) -> None:
    folder, kind = rerun
    changes = CHANGE if kind == "what-if" else ""
    content = json.loads(done("report", folder, "--json"))
    assert content["passed"] is None and content["criteria"] == []
    assert content["rerun"] == {"of": flight.name, "changes": changes}
    assert content["planner_p99_ms"] is None  # its planner waited for no clock
    assert content["target_rmse_m"] is not None
    page, terminal = (folder / "report.html").read_text(), done("report", folder, "--no-plot")
    for text in (page, terminal):
        assert kind.upper() in text and f"of {flight.name}" in text and changes in text and "nothing is judged" in text
        assert "PASSED" not in text and "FAILED" not in text


def test_a_comparison_says_which_is_no_flight(rerun: tuple[Path, str], flight: Path) -> None:
    folder, kind = rerun
    terminal = done("report", flight, "--compare", folder)
    page = (flight / "comparison.html").read_text()
    for text in (terminal, page):
        assert f"second ({kind})" in text and "first (" not in text.replace("first (passed)", "")
        assert f"{kind} of {flight.name}" in text
    content = json.loads(done("report", flight, "--compare", folder, "--json"))
    assert content["reruns"]["first"] is None and content["reruns"]["second"]["of"] == flight.name


def test_a_flight_is_judged_as_before(flight: Path) -> None:
    result = CliRunner().invoke(groundstation, ["report", str(flight), "--json", "--no-plot"], standalone_mode=False)
    content = json.loads(result.output)
    assert content["rerun"] is None and content["criteria"] and content["passed"] in (True, False)
    assert result.return_value == (0 if content["passed"] else 1)

"""What `config check` says about a scenario that does not fit the field."""

from pathlib import Path

import pytest

from groundstation.cli import main as cli

LAB = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"


def test_a_path_that_leaves_the_room_is_told_before_the_rehearsal(capsys: pytest.CaptureFixture[str]) -> None:
    narrow = ("--set", "room.size_m=[8, 1.5, 4.5]", "--set", "room.fence.y_m=[-0.7, 0.7]")
    assert cli.run(["config", "check", str(LAB), "--scenario", "realistic", *narrow]) == 2
    assert "realistic: the path of turtlebot leaves the room" in capsys.readouterr().err


def test_a_target_that_is_parked_on_a_pad_is_told_before_the_rehearsal(capsys: pytest.CaptureFixture[str]) -> None:
    below = ("--set", "drones.drone_1.pad_m=[0.1, 0.1]")
    assert cli.run(["config", "check", str(LAB), "--scenario", "realistic", *below]) == 2
    told = "realistic: turtlebot is parked at (0.0, 0.0), 0.1 m from the pad of drone_1, and hides its marker"
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    ("field", "scenario", "told"),
    [
        (str(LAB), "hall", "hall: is made for a field changed as its expected.set says"),
        (str(LAB), "unkind-autopilots", "unkind-autopilots: is made for the field mixed-team"),
        ("mixed-team", "unkind-autopilots", ""),
        (str(LAB), "random-walk", ""),
    ],
)
def test_a_scenario_of_another_field_is_told_before_the_rehearsal(
    capsys: pytest.CaptureFixture[str], field: str, scenario: str, told: str
) -> None:
    assert cli.run(["config", "check", field, "--scenario", scenario]) == 0
    printed = capsys.readouterr().out
    assert told in printed and ("is made for" in printed) is bool(told)

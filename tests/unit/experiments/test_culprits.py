"""Attribution of faults: verdicts on flights of wrong labs, by the operator's notices."""

from dataclasses import replace
from typing import Any

import click
import pytest

from groundstation.cli.experiment_culprits import _seconds
from groundstation.experiments.culprit_rows import STAND_S, WrongLab, labs_of, size_told
from groundstation.experiments.culprits import accusations, row_of, table, verdict_on

FIELD = {"cameras": {"ceiling": {}}, "drones": {"a": {}, "b": {}}, "target": {"name": "rover"}}
LABS = {lab.name: lab for lab in labs_of(FIELD)}
EXPLAINS = ": that explains best why the team's sightings disagree"


def flown(*told: tuple[float, str, str], on_pads: tuple[tuple[str, str], ...] = (), remedy: str = "") -> dict[str, Any]:
    rows = [(at_s, "WARNING", entity, text, remedy) for at_s, entity, text in told]
    return {"seed": 1, "flown": True, "on_pads": on_pads, "told": rows, "rmse_m": 0.03}


@pytest.mark.parametrize(
    ("name", "line", "size"),
    [
        ("all markers", "pads: all markers are 4.9 +- 0.3 % larger than the field says", 4.9),
        ("ceiling's pictures", "ceiling: ceiling's pictures are 48 +- 3 ms older than configured", 48.0),
        ("ceiling's pictures", "ceiling: its pictures seem 52 +- 4 ms older than configured", 52.0),
        ("a drone's pictures", "a: the pictures of a's camera are 45 +- 6 ms older than configured", 45.0),
        ("pan of one", "a: a's camera looks 2.8 +- 0.2 deg farther to the left than the field says", 2.8),
        ("tilt of both", ": every drone's camera looks 3.3 +- 0.4 deg lower than the field says", 3.3),
        ("target's marker", "rover: rover's marker is 5.2 +- 0.5 % larger than the field says", 5.2),
        ("ceiling tilted", "pads: the camera ceiling is tilted by 3.0 +- 0.1 deg compared with the field", 3.0),
        ("a wrong pad", "pads: a stands 0.51 +- 0.01 m from its pad, turned by 0 deg", 0.51),
    ],
)
def test_the_size_of_the_right_culprit_is_read(name: str, line: str, size: float) -> None:
    assert size_told(LABS[name], line) == pytest.approx(size)
    assert all(size_told(lab, line) is None for lab in LABS.values() if lab.name != name)


def test_an_accusation_is_what_names_a_culprit_and_is_not_excused() -> None:
    notices = ((3.0, "a", "re-initialised by ceiling"), (4.0, "b", "what a sees of it contradicts the belief for 3 s"))
    assert accusations(flown(*notices)) == [(4.0, "b: what a sees of it contradicts the belief for 3 s")]
    assert accusations(flown(*notices, remedy="probably not its fault: all markers")) == []


def test_ends_of_a_wrong_lab() -> None:
    lab = LABS["all markers"]
    right = (12.0, "", "all markers are 6.0 +- 0.3 % larger than the field says" + EXPLAINS)
    other = (
        5.0,
        "b",
        "what b's camera sees of rover contradicts the belief for 3 s: NIS 9 per degree of freedom, not 1",
    )
    pads = (("MUST", "pads: all markers are 5.0 +- 0.3 % larger than the field says"),)
    assert verdict_on(lab, flown(right))["end"] == "right"
    assert verdict_on(lab, flown(right))["size_error"] == pytest.approx(0.2)
    assert verdict_on(lab, flown(other, right))["end"] == "wrong"
    assert verdict_on(lab, flown((25.0, *right[1:])))["end"] == "late"
    besides = verdict_on(lab, flown(right, other))
    assert besides["end"] == "wrong" and besides["said"] == f"b: {other[2]}", "it need not be the first"
    begun = replace(lab, faults=({"start_s": STAND_S + 10.0},))
    assert verdict_on(begun, flown((25.0, *right[1:])))["end"] == "right"
    assert verdict_on(begun, flown((9.0, *right[1:])))["end"] == "wrong", "it was not wrong yet"
    assert verdict_on(lab, flown(other, on_pads=pads))["end"] == "refused"
    assert verdict_on(lab, flown())["end"] == "silent"


def test_a_second_name_besides_a_bumped_camera_is_wrong() -> None:
    lab = LABS["ceiling bumped"]
    bumped = (19.0, "ceiling", "was bumped: all that it sees is displaced by 0.3 m, as if turned by 4.9 +- 0.9 deg")
    same = (21.0, "ceiling", "what ceiling sees of a contradicts the belief for 3 s")
    older = (24.0, "ceiling", "ceiling's pictures are 146 +- 13 ms older than configured" + EXPLAINS)
    lens = (24.0, "b", "b's camera has a focal length 6.9 +- 0.9 % longer than calibrated" + EXPLAINS)
    assert verdict_on(lab, flown(bumped, same))["end"] == "right"
    assert [verdict_on(lab, flown(bumped, other))["end"] for other in (older, lens)] == ["wrong", "wrong"]


def test_a_healthy_lab_must_be_silent() -> None:
    lab = LABS["nothing"]
    assert verdict_on(lab, flown())["end"] == "silent"
    assert (
        verdict_on(lab, flown((4.0, "a", "its pictures seem 40 +- 3 ms older than configured")))["end"] == "false alarm"
    )


def test_a_device_that_fails_makes_no_figure_wrong() -> None:
    lab = LABS["ceiling's picture hangs"]
    (fault,) = lab.faults
    assert (fault["kind"], fault["entity"]) == ("picture_frozen", "ceiling") and lab.since_s > 8.0
    assert verdict_on(lab, flown((19.0, "a", "messages are refused: FROZEN")))["end"] == "silent"
    blamed = "ceiling's pictures are 48 +- 3 ms older than configured" + EXPLAINS
    assert verdict_on(lab, flown((19.0, "ceiling", blamed)))["end"] == "false alarm"


def test_a_diagnosis_that_begins_in_the_air_blames_nobody() -> None:
    lab = LABS["diagnosis begun in the air"]
    assert lab.diagnosed_from_s > 15.0 and LABS["nothing"].diagnosed_from_s == 0.0
    blamed = "drone_2's camera has a focal length 7.6 +- 2.2 % shorter than calibrated" + EXPLAINS
    assert verdict_on(lab, flown((27.0, "drone_2", blamed)))["end"] == "false alarm"


def test_a_row_counts_what_was_wanted_and_names_the_rest() -> None:
    lab = WrongLab("x", says="a: (\\d+) off", size=10.0, on_pads=True)
    ends = ((1, 0.1, "refused"), (2, 0.4, "refused"), (3, 0.0, "right"), (4, None, "wrong"))
    usual = {"at_s": 0.0, "refuted": False, "rmse_m": 0.1, "said": "b: 3 off"}
    found = [{"seed": seed, "size_error": error, "end": end, **usual} for seed, error, end in ends]
    row = row_of(lab, found)
    assert (row["as_wanted"], row["flights"], row["size_ok"], row["sizes"]) == (2, 4, 2, 3)
    assert row["otherwise"] == {4: "b: 3 off"}
    assert "2/4" in table([row])[1] and "seed 4: b: 3 off" in table([row])[2]


def test_a_flight_that_never_was_is_not_as_wanted() -> None:
    down = {"flown": False, "rmse_m": None}
    for lab in (LABS["nothing"], LABS["a drone's velocity is stuck"], LABS["all markers"]):
        found = verdict_on(lab, flown() | down)
        assert found["end"] == "not flown"
        row = row_of(lab, [found])
        assert (row["as_wanted"], row["flights"]) == (0, 1) and "not flown 1" in table([row])[1]
    pads = (("MUST", "pads: all markers are 5.0 +- 0.3 % larger than the field says"),)
    assert verdict_on(LABS["all markers"], flown(on_pads=pads) | down)["end"] == "refused", "the pads sufficed"


@pytest.mark.parametrize("name", ["ceiling's picture hangs", "ceiling bumped"])
def test_a_flight_lasts_until_its_fault_must_have_been_named(name: str) -> None:
    lab = LABS[name]
    needs = lab.since_s + 20.0
    assert _seconds(lab, None) == _seconds(lab, needs) == needs > 25.0
    with pytest.raises(click.UsageError, match=rf"--duration 5: row .*{name}.* needs 38 or more: .* begins 18 s after"):
        _seconds(lab, 5.0)


def test_a_lab_that_is_wrong_from_the_start_is_flown_as_ever() -> None:
    lab = LABS["all markers"]
    assert (_seconds(lab, None), _seconds(lab, 20.0)) == (25.0, 20.0)
    with pytest.raises(click.UsageError, match="needs 20 or more: what is wrong must be named within 20 s"):
        _seconds(lab, 19.0)

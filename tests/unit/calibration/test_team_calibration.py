"""Calibration of all team settings from one recording: finds each wrong one with its size, and no others."""

import math
from typing import Any

import numpy as np
import pytest
from swinging_lab import CLOCK, SECONDS, Lab

from groundstation.calibration.flown import Flown
from groundstation.calibration.team import TeamCalibration, calibrate_team
from groundstation.calibration.team_batch import TeamBatch
from groundstation.calibration.team_figures import Figures
from groundstation.calibration.team_record import team_record
from groundstation.calibration.team_settings import changes, with_changes
from groundstation.errors import OperatorMistake
from groundstation.field.resolved import ResolvedField
from sim_bridge.study.wrong_figures import WrongFigures


def calibrated(field: ResolvedField, errors: dict[tuple[str, str], float], seconds: float = SECONDS) -> TeamCalibration:
    return calibrate_team(Lab(field, WrongFigures(errors), seconds=seconds).flown(), field)


def test_nothing_is_proposed_where_the_field_is_right(lab_field: ResolvedField) -> None:
    found = calibrated(lab_field, {})
    assert found.found == () and found.settings == {} and found.gain is None
    assert {one.who for one in found.figures} == {"ceiling", "drone_1", "drone_2", "turtlebot"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("errors", "who", "what", "setting", "wanted", "within"),
    [
        ({("drone_2", "pan"): -3.0}, "drone_2", "pan", "drones.drone_2.camera.pan_left_deg", -3.0, 0.3),
        ({("drone_2", "delay"): 50.0}, "drone_2", "delay", "drones.drone_2.camera.video_delay_ms", 170.0, 5.0),
        ({("ceiling", "delay"): -50.0}, "ceiling", "delay", "cameras.ceiling.video_delay_ms", 70.0, 5.0),
        ({("turtlebot", "print"): 0.05}, "turtlebot", "print", "target.marker.square_mm", 46.2, 0.22),
        ({("drone_1", "focal"): 0.04}, "drone_1", "focal", "drones.drone_1.camera.calibration.fx_px", 1.04, 0.008),
    ],
)
def test_one_wrong_figure_is_proposed_with_its_size(
    lab_field: ResolvedField,
    errors: dict[tuple[str, str], float],
    who: str,
    what: str,
    setting: str,
    wanted: float,
    within: float,
) -> None:
    found = calibrated(lab_field, errors, seconds=16.0)
    assert [(one.who, one.what) for one in found.found] == [(who, what)]
    settings = {".".join(path): value for path, value in found.settings.items()}
    now = lab_field.drones["drone_1"].camera.calibration.fx_px if what == "focal" else 1.0
    assert settings[setting] / now == pytest.approx(wanted, abs=within)


def test_late_telemetry_changes_no_setting(lab_field: ResolvedField) -> None:
    figures = Figures(lab_field, tuple(lab_field.drones))
    late = np.zeros(len(figures.keys))
    late[figures.place["drone_1", "own_delay"]] = 0.05
    assert changes(figures, late, late != 0.0) == {}


@pytest.mark.parametrize(
    ("part", "now", "setting", "wanted"),
    [
        ("pan", {"camera": {"pan_left_deg": 179.0}}, "pan_left_deg", -179.0),
        ("tilt", {"camera": {"tilt_down_deg": 89.0}}, "tilt_down_deg", 90.0),
        ("velocity_delay", {"odometry": {"velocity_delay_ms": 30.0}}, "velocity_delay_ms", 0.0),
    ],
)
def test_new_values_are_such_as_can_be_set(
    lab_field: ResolvedField, part: str, now: dict[str, dict[str, float]], setting: str, wanted: float
) -> None:
    ((section, values),) = now.items()
    place = ("drones", "drone_1", section, setting)
    field = with_changes(lab_field, {place: values[setting]})
    figures = Figures(field, tuple(field.drones))
    error = np.zeros(len(figures.keys))
    error[figures.place["drone_1", part]] = -0.034 if part == "velocity_delay" else math.radians(2.0)
    assert changes(figures, error, error != 0.0)[place] == wanted


def test_a_ceiling_camera_that_is_turned_shows_by_the_pads_alone(lab_field: ResolvedField) -> None:
    """The whole world turns with it: two drones on their pads show it, to 0.65 deg, and a flight adds nothing."""
    found = calibrated(lab_field, {("ceiling", "yaw"): 3.0})
    assert [(one.who, one.what) for one in found.found] == [("ceiling", "yaw")]
    assert found.found[0].error == pytest.approx(3.0, abs=0.3) and 0.5 < found.found[0].std < 0.8
    rotation = with_changes(lab_field, found.settings).cameras["ceiling"].rotation_deg
    assert rotation == pytest.approx((0.0, 0.0, 3.0), abs=0.3)


def test_pads_are_known_as_well_however_many_sightings_say_the_same(lab_field: ResolvedField) -> None:
    batch = TeamBatch(team_record(Lab(lab_field, WrongFigures({})).flown(), lab_field), lab_field)
    wide = np.diag(batch.figures.wide**2)
    once, fourth = batch.fit(wide), batch.fit(wide, alike=4.0)
    for key, least, most in ((("ceiling", "yaw"), 0.8, 1.0), (("drone_1", "focal"), 0.2, 0.35)):
        place = batch.figures.place[key]
        assert least < fourth.information[place, place] / once.information[place, place] < most, key


@pytest.mark.slow
def test_a_tilted_ceiling_camera_and_its_new_setting(lab_field: ResolvedField) -> None:
    found = calibrated(lab_field, {("ceiling", "pitch"): 3.0})
    assert [(one.who, one.what) for one in found.found] == [("ceiling", "tilted")]
    rotation = with_changes(lab_field, found.settings).cameras["ceiling"].rotation_deg
    assert rotation == pytest.approx((0.0, 3.0, 0.0), abs=0.3)
    assert found.gain is not None and found.gain.after_m < 0.5 * found.gain.before_m


@pytest.mark.slow
def test_prints_that_are_all_scaled_are_one_cause(lab_field: ResolvedField) -> None:
    names = ("drone_1", "drone_2", "turtlebot")
    found = calibrated(lab_field, {(name, "print"): 0.05 for name in names})
    assert [(one.who, one.what) for one in found.found] == [("", "print")]
    sizes: list[Any] = list(found.settings.values())
    assert sizes == pytest.approx([46.2] * 3, abs=0.22)


def test_a_recording_in_which_no_fixed_camera_saw_a_drone_is_refused(lab_field: ResolvedField) -> None:
    flown = Lab(lab_field, WrongFigures({})).flown()
    blind = tuple((now, tuple(p for p in inputs if p[0] != "observation")) for now, inputs in flown.ticks)
    with pytest.raises(OperatorMistake, match="no fixed camera saw any drone"):
        calibrate_team(Flown(blind, CLOCK), lab_field)


def test_figures_hardly_observable_are_named_with_the_figure_they_resemble(lab_field: ResolvedField) -> None:
    """A fixed camera that is displaced sees nearly the same as one that is tilted."""
    figures = {(one.who, one.part): one for one in calibrated(lab_field, {}).figures}
    for place, turn in (("x", "pitch"), ("y", "roll")):
        assert figures["ceiling", place].beside == ("ceiling", turn)
        assert not figures["ceiling", place].shown
    assert figures["drone_1", "pan"].shown and figures["drone_1", "pan"].beside is None

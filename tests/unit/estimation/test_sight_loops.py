"""Loops of sightings name the figure that is wrong, with its size, and nothing where all are right."""

import math

import numpy as np
import pytest

from groundstation.bus.messages import Header, RelativeObservation, Severity
from groundstation.estimation.attitude_intake import Lean
from groundstation.estimation.figure_suspicion import FigureSuspicion, Suspect
from groundstation.estimation.sight_loops import Gap
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import (
    base_from_tilted_optical,
    rotation_from_euler,
    rotation_z,
    world_from_downward_optical,
)
from groundstation.runtime.figure_watch import FigureWatch

LEAN = math.radians(0.6)  # deviation of how a drone leans from what it tells, for five seconds at a time
TARGET_M = 0.4


class Room:
    """Two drones that look at a target in the middle from both sides, and the ceiling camera over them.

    prints: shares by name ("": all); pan_deg, tilt_deg: of drone_1's camera; ceiling_deg: pitch of the ceiling camera.
    """

    def __init__(self, field: ResolvedField, seed: int, **wrong: float) -> None:
        self.field, self.rng, self.wrong = field, np.random.default_rng(seed), wrong
        self.lean = {name: np.zeros(2) for name in field.drones}

    def place(self, name: str, at_s: float) -> tuple[np.ndarray, float]:
        side = -1.0 if name == "drone_1" else 1.0
        swing = 0.3 * math.sin(0.4 * at_s + side)
        at = np.array([side * 1.0 + 0.2 * swing, swing, 1.6])
        return at, math.atan2(-at[1], -at[0]) + 0.1 * math.sin(0.5 * at_s)

    def sight(self, observer: str, subject: str, at_s: float, optical: np.ndarray, yaw: float) -> RelativeObservation:
        scale = (1.0 + self.wrong.get("all", 0.0)) * (1.0 + self.wrong.get(subject, 0.0))
        seen = optical / scale + 0.004 * self.rng.standard_normal(3)
        return RelativeObservation(
            header=Header(round(at_s * 1e9), "c", observer, observer, 1),
            observer=observer,
            subject=subject,
            camera=observer,
            position_m=tuple(seen.tolist()),
            yaw_rad=yaw,
            covariance=tuple((1e-4 * np.eye(4)).ravel().tolist()),
        )

    def pictures(self, at_s: float) -> list[RelativeObservation]:
        found = []
        ceiling = self.field.cameras["ceiling"]
        down = world_from_downward_optical(ceiling.rotation_deg)
        turned = rotation_from_euler(0.0, math.radians(self.wrong.get("ceiling_deg", 0.0)), 0.0)
        for name, drone in self.field.drones.items():
            if self.rng.random() < 1.0 / 75.0 or at_s < 0.1:
                self.lean[name] = LEAN * self.rng.standard_normal(2)
            base, yaw = self.place(name, at_s)
            marker = base + rotation_z(yaw) @ np.array(drone.marker.position_m)
            found.append(
                self.sight("ceiling", name, at_s, down.T @ turned.T @ (marker - np.array(ceiling.position_m)), yaw)
            )
            off = self.wrong.get("pan_deg", 0.0), self.wrong.get("tilt_deg", 0.0)
            pan, tilt = off if name == "drone_1" else (0.0, 0.0)
            eye = drone.camera
            pan_rad = math.radians(eye.pan_left_deg + pan) + self.lean[name][0]
            tilt_rad = math.radians(eye.tilt_down_deg + tilt) + self.lean[name][1]
            relative = rotation_z(yaw).T @ (np.array([0.0, 0.0, TARGET_M]) - base) - np.array(eye.position_m)
            optical = base_from_tilted_optical(tilt_rad, pan_rad).T @ relative
            found.append(self.sight(name, "turtlebot", at_s + 0.02, optical, -yaw - math.radians(pan)))
        return found

    def told(self, seconds: float) -> list[tuple[Severity, str, str]]:
        watch, said = FigureWatch(self.field, "c"), []
        for picture in range(round(seconds * 15)):
            at_s = 100.0 + picture / 15.0
            for sighting in self.pictures(at_s - 100.0):
                shifted = sighting.header.stamp_ns + 100 * 10**9
                watch.take(
                    RelativeObservation(
                        **{f: getattr(sighting, f) for f in sighting.__struct_fields__ if f != "header"},
                        header=Header(shifted, "c", sighting.observer, sighting.observer, 1),
                    ),
                    Lean(sighting.roll_rad, sighting.pitch_rad),
                )
            if picture % 15 == 14:
                notices = watch.notices(round((at_s + 0.05) * 1e9))
                said += [(one.severity, one.text, one.remedy) for one in notices]
        return said


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_told_where_all_figures_are_right(lab_field: ResolvedField, seed: int) -> None:
    assert Room(lab_field, seed).told(20.0) == []


@pytest.mark.parametrize(
    ("wrong", "words", "remedy"),
    [
        ({"all": 0.06}, "all markers are", "ruler"),
        ({"turtlebot": 0.08}, "turtlebot's marker is", "ruler"),
        ({"tilt_deg": 6.0}, "drone_1's camera looks", "drones.drone_1.camera.tilt_down_deg: 5"),
        ({"pan_deg": 5.0}, "drone_1's camera looks", "drones.drone_1.camera.pan_left_deg: "),
        ({"ceiling_deg": 4.0}, "the camera ceiling is tilted by", "survey it anew"),
    ],
)
def test_one_wrong_figure_is_told_with_size_and_remedy(
    lab_field: ResolvedField, wrong: dict[str, float], words: str, remedy: str
) -> None:
    said = Room(lab_field, 1, **wrong).told(14.0)
    assert said and said[-1][0] is Severity.WARNING
    assert words in said[-1][1] and "+-" in said[-1][1]
    assert remedy in said[-1][2]


@pytest.mark.slow
def test_figures_that_are_right_again_are_refuted(lab_field: ResolvedField) -> None:
    room = Room(lab_field, 2, all=0.06)
    watch = FigureWatch(lab_field, "c")
    states = []
    for picture in range(15 * 150):
        if picture == 15 * 20:
            room.wrong = {}
        for sighting in room.pictures(picture / 15.0):
            watch.take(sighting, Lean(sighting.roll_rad, sighting.pitch_rad))
        if picture % 15 == 14:
            states += [notice.severity for notice in watch.notices(round((picture / 15.0 + 0.05) * 1e9))]
    assert states[0] is Severity.WARNING and states[-1] is Severity.INFO
    assert watch.cause == ""


def gaps_of_a_late_camera(late_s: float, seed: int, seconds: int) -> list[Gap]:
    """Loops of a drone that sways: their slope by drone_1's delay is its speed, and a slow error lasts."""
    rng, found = np.random.default_rng(seed), []
    for count in range(seconds * 6):
        at_s = count / 6.0
        speed = 0.15 * math.sin(4.0 * at_s)
        apart = 0.02 * math.sin(0.3 * at_s) - speed * late_s + 0.008 * rng.standard_normal()
        slope = np.array([[0.0, speed, 0.0]])
        found.append(Gap("loop", at_s, np.array([apart]), slope, 0.02, 0.012))
    return found


def test_a_late_camera_shows_within_a_second_where_what_lasts_does_not_count() -> None:
    keys = (("", "print"), ("drone_1", "delay"), ("drone_2", "delay"))
    for late_s, named in ((0.05, [Suspect("drone_1", "delay")]), (0.0, [])):
        suspicion = FigureSuspicion(keys, {})
        for gap in gaps_of_a_late_camera(late_s, 1, 30):
            suspicion.take(gap)
        charges = [suspicion.judge() for _ in range(3)][-1]
        assert [one.suspect for one in charges] == named
        assert all(abs(one.size - late_s) < 3.0 * one.std < 0.04 for one in charges)


def test_an_imu_makes_a_smaller_tilt_suspect() -> None:
    slope = np.array([[1.5]])
    gaps = [Gap("loop", n / 5.0, np.array([-1.5 * math.radians(2.8)]), slope, 0.02, 0.012) for n in range(100)]
    told = []
    for levelled in ((), ("drone_1",)):
        suspicion = FigureSuspicion((("drone_1", "tilt"),), {})
        for gap in gaps:
            suspicion.take(gap)
        told.append([bool(suspicion.judge(levelled)) for _ in range(3)][-1])
    assert told == [False, True]


def test_two_figures_freed_in_turn_are_judged_as_if_both_had_been_free_from_the_start() -> None:
    keys = (("drone_1", "pan"), ("drone_2", "pan"), ("", "print"))
    rng = np.random.default_rng(4)
    suspicion = FigureSuspicion(keys, {})
    error = np.array([0.05, 0.04, 0.0])
    for n, slope in enumerate(np.repeat(3.0 * rng.normal(size=(12, 3)), 5, axis=0)):
        suspicion.take(Gap("loop", n / 5.0, np.array([-slope @ error]), slope[None], 0.02, 0.012))
    for _ in range(3):
        charges = suspicion.judge()
    both = next(one for one in charges if one.suspect == Suspect("", "pan"))

    information, pull = suspicion._information, suspicion._pull
    surveyed = np.array([math.radians(0.5)] * 2 + [0.003])
    free = np.array([math.radians(5.0)] * 2 + [0.003])

    def evidence(sigma: np.ndarray) -> float:
        posterior = np.linalg.inv(information + np.diag(sigma**-2.0))
        return 0.5 * float(pull @ posterior @ pull + np.linalg.slogdet(posterior)[1] - 2.0 * np.log(sigma).sum())

    posterior = np.linalg.inv(information + np.diag(free**-2.0))
    sizes = posterior @ pull
    most = int(np.argmax(np.abs(sizes[:2])))
    assert both.size == pytest.approx(sizes[most], rel=1e-6)
    assert both.std == pytest.approx(math.sqrt(posterior[most, most]), rel=1e-6)
    assert both.lead == pytest.approx(evidence(free) - evidence(surveyed), rel=1e-6)

"""Robots that read landmarks and each other while one robot's commands, or many readings, are wrong."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from groundstation.arrays import Array
from groundstation.bus.messages import Verdict
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import OdometrySample, SensorReading
from groundstation.estimation.models import CommandedRobot, Landmark, RangeBearingSensor
from groundstation.estimation.parameters import EstimatorParameters

START = 10**12
COMMANDS_HZ, READINGS_HZ = 50, 5
DEPTH_STD_M, BEARING_STD_RAD = 0.03, 0.015
VIEW_RAD, REACH_M = 0.6, 6.0
LANDMARKS = {f"post_{i}": (4.0 * math.cos(i * math.tau / 10), 3.0 * math.sin(i * math.tau / 10)) for i in range(10)}
COURSES = {"a": (-2.0, 0.0, 0.0, 0.2, 0.15), "b": (1.5, -1.0, 1.0, 0.25, -0.2), "c": (0.0, 1.0, 2.0, 0.2, 0.12)}


@dataclass
class Faults:
    """deaf: its commands are reported as zero; misread: share of readings that name another marker.

    c_off: by how much robot c is placed wrong, in x, y and heading.
    """

    deaf: str = ""
    misread: float = 0.0
    c_off: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Team:
    """Three robots on circles among ten posts; nothing but the filter is told of commands and readings."""

    def __init__(self, faults: Faults, seed: int, landmarks: Mapping[str, tuple[float, float]] = LANDMARKS) -> None:
        eyes = {name: RangeBearingSensor(name, is_depth=True) for name in COURSES}
        posts = {name: Landmark((*place, 0.0)) for name, place in landmarks.items()}
        # The posts come last: a block beyond theirs would lie beyond the state.
        robots = {name: CommandedRobot(turn_drag_m=0.0, response_s=0.0, lag_s=0.01) for name in COURSES}
        self.filter = FixedLagFilter(EstimatorParameters({**robots, **posts}, eyes, step_s=0.02, max_lateness_s=0.1))
        self.poses = {name: np.array(course[:3]) for name, course in COURSES.items()}
        self.now, self._faults, self._rng = START, faults, np.random.default_rng(seed)
        self._landmarks = landmarks
        for name, (x, y, yaw, _, _) in COURSES.items():
            dx, dy, turned = faults.c_off if name == "c" else (0.0, 0.0, 0.0)
            self.filter.place(name, (x + dx, y + dy, 0.0, yaw + turned), (1e-4, 1e-4, 1e-6, 4e-4), START, START)

    def drive(self, seconds: float) -> None:
        """Drive on; robots read what is before them."""
        for step in range(round(seconds * COMMANDS_HZ)):
            self.now += 10**9 // COMMANDS_HZ
            for name, (_, _, _, v, w) in COURSES.items():
                told = (0.0, 0.0) if name == self._faults.deaf else (v, w)
                sample = OdometrySample(self.now, (told[0], 0.0, 0.0), yaw_rate_rad_s=told[1])
                self.filter.add_motion(name, sample, self.now)
                pose, middle = self.poses[name], self.poses[name][2] + 0.5 * w / COMMANDS_HZ
                pose += np.array((v * math.cos(middle), v * math.sin(middle), w)) / COMMANDS_HZ
            if step % (COMMANDS_HZ // READINGS_HZ) == 0:
                self._read()
            self.filter.advance(self.now)

    def _read(self) -> None:
        markers = {**self._landmarks, **{name: (float(pose[0]), float(pose[1])) for name, pose in self.poses.items()}}
        for name in self.poses:
            for subject, place in markers.items():
                way, bearing = self._true(name, place)
                if subject == name or way > REACH_M or abs(bearing) > VIEW_RAD:
                    continue
                if self._rng.random() < self._faults.misread:
                    subject = str(self._rng.choice([other for other in markers if other != name]))
                self.read(name, subject, way * math.cos(bearing), bearing)

    def _true(self, observer: str, place: tuple[float, float]) -> tuple[float, float]:
        x, y, yaw = self.poses[observer]
        bearing = math.remainder(math.atan2(place[1] - y, place[0] - x) - yaw, math.tau)
        return math.dist((x, y), place), bearing

    def see(self, observer: str, post: str) -> None:
        """Add the reading of a post, wherever it stands."""
        way, bearing = self._true(observer, self._landmarks[post])
        self.read(observer, post, way * math.cos(bearing), bearing)

    def read(self, observer: str, subject: str, depth: float, bearing: float) -> None:
        """Add a reading, with its noise."""
        z = (depth + DEPTH_STD_M * self._rng.standard_normal(), bearing + BEARING_STD_RAD * self._rng.standard_normal())
        covariance = (DEPTH_STD_M**2, 0.0, 0.0, BEARING_STD_RAD**2)
        self.filter.add_observation(
            SensorReading(self.now, observer, subject, z, covariance), observer + subject, self.now
        )

    def errors_m(self) -> dict[str, float]:
        belief = self.filter.belief()
        return {name: float(np.hypot(*(belief.mean_of(name)[:2] - pose[:2]))) for name, pose in self.poses.items()}

    def state_of(self, name: str) -> tuple[Array, Array]:
        belief = self.filter.belief()
        return belief.mean_of(name), belief.covariance_of(name)


class Blinkered(Team):
    """Robots that read posts only."""

    def read(self, observer: str, subject: str, depth: float, bearing: float) -> None:
        """Add a reading, unless it is of a robot."""
        if subject not in COURSES:
            super().read(observer, subject, depth, bearing)


def worst_m(team: Team, seconds: int) -> dict[str, float]:
    """Return each robot's largest error, a second apart."""
    worst = dict.fromkeys(COURSES, 0.0)
    for _ in range(seconds):
        team.drive(1.0)
        worst = {name: max(worst[name], error) for name, error in team.errors_m().items()}
    return worst


def test_a_robot_that_moves_without_commands_loses_itself_for_a_moment_only_and_nobody_else() -> None:
    """On real data, one such robot of five displaced the whole team by metres."""
    for seed in (1, 2, 3):
        worst = worst_m(Team(Faults(deaf="c"), seed), 60)
        assert max(worst["a"], worst["b"]) <= 0.15
        assert worst["c"] <= 1.0


def test_a_team_outlasts_one_misread_marker_in_five() -> None:
    for seed in (1, 2, 3):
        assert max(worst_m(Team(Faults(misread=0.2), seed), 60).values()) <= 0.3


@pytest.mark.parametrize(("ahead_m", "turned_rad"), [(1.5, 0.0), (0.0, 1.5), (1.0, 1.0)])
def test_a_robot_that_was_placed_wrong_finds_its_place_by_landmarks(ahead_m: float, turned_rad: float) -> None:
    team = Team(Faults(c_off=(ahead_m, 0.0, turned_rad)), 4)
    team.drive(20.0)
    assert max(team.errors_m().values()) <= 0.15


@pytest.mark.parametrize(
    "c_off", [(0.0, 0.0, 1.57), (0.0, 0.0, 2.6), (3.0, 0.0, 0.0), (-2.1, 2.1, 0.0), (-3.0, 0.0, 2.6), (0.0, 3.0, 2.6)]
)
def test_a_lost_robot_that_reads_few_landmarks_is_thrown_nowhere(c_off: tuple[float, float, float]) -> None:
    """By noise on its pose and a linearised correction it was, by up to 40 m; with a right turn before, by 16 m."""
    few = {name: LANDMARKS[name] for name in ("post_0", "post_3", "post_6")}
    for seed in (1, 2, 3):
        team, corrected, prior, worst = Blinkered(Faults(c_off=c_off), seed, few), False, 0.0, 0.0
        for _ in range(300):
            before = worst
            team.drive(0.2)
            used = (Verdict.ACCEPTED, Verdict.INFLATED)
            corrected |= any(c.observer == "c" and c.verdict in used for c in team.filter.take_corrections())
            prior = prior if corrected else max(prior, team.errors_m()["c"])
            worst = max(worst, team.errors_m()["c"])
            assert worst <= max(before, prior) + 1.0
        assert team.errors_m()["c"] <= 0.3


def test_misread_landmarks_that_a_right_one_follows_move_nobody() -> None:
    team = Team(Faults(), 7)
    for k in range(40):
        team.now += 2 * 10**8
        if k % 5 < 4:
            team.read("c", "post_8", 2.0, 0.1)
        else:
            team.see("c", "post_3")
        team.filter.advance(team.now)
        assert team.errors_m()["c"] <= 0.2


def test_a_robot_that_faces_the_wrong_way_turns_towards_the_landmark_that_it_reads() -> None:
    """Turned by the bearing's residual with the wrong sign, it was thrown off by metres."""
    for turned in (-2.6, -1.5, 1.5, 2.6):
        team = Team(Faults(c_off=(0.0, 0.0, turned)), 6)
        for _ in range(12):
            team.now += 10**8
            team.see("c", "post_5")
            team.filter.advance(team.now)
        assert abs(math.remainder(team.state_of("c")[0][3] - team.poses["c"][2], math.tau)) <= 0.1
        assert team.errors_m()["c"] <= 0.1


def test_a_landmark_that_is_read_far_off_touches_no_state_but_its_readers() -> None:
    """It has no block: to put it elsewhere would write into another's, or beyond the state."""
    team, alone = Team(Faults(), 5), Team(Faults(), 5)
    for _ in range(12):
        team.now = alone.now = team.now + 10**8
        team.read("a", "post_5", 4.0, 2.0)
        for each in (team, alone):
            each.filter.advance(each.now)
    verdicts = [correction.verdict for correction in team.filter.take_corrections()]
    assert verdicts[:4] == [Verdict.IMPLAUSIBLE] * 4 and Verdict.INFLATED in verdicts
    for name in ("b", "c"):
        for got, expected in zip(team.state_of(name), alone.state_of(name), strict=True):
            np.testing.assert_array_equal(got, expected)
    assert team.filter.belief().mean.shape == alone.filter.belief().mean.shape
    assert float(np.trace(team.state_of("a")[1])) > float(np.trace(alone.state_of("a")[1]))

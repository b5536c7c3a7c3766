"""Limits on re-initialisations by one observer: several robots at once, or one repeatedly, count against it."""

import math

import numpy as np
import pytest

from groundstation.bus.messages import Verdict
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Correction, Measurement, OdometrySample
from groundstation.estimation.models import FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.models.protocol import MotionModel
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters

MS = 1_000_000
START = 10_000_000_000_000
COVARIANCE = tuple(np.diag([1e-4, 1e-4, 1e-4, 1e-3]).ravel().tolist())
FLIGHT_M = 1.3
PLACES = {"a": (-1.0, 0.0), "b": (1.0, 0.3)}


class Team:
    """Two drones that hover below a ceiling camera, which observes both at 10 Hz with given displacements.

    A silent one is neither observed nor sends telemetry; unseen: neither is observed.
    """

    def __init__(self) -> None:
        entities: dict[str, MotionModel] = {n: OdometryRobot(marker_position_m=(0.0, 0.0, 0.0)) for n in PLACES}
        entities["ceiling"] = FixedMount((0.0, 0.0, 4.2), 0.004, 0.01)
        self.filter = FixedLagFilter(
            EstimatorParameters(entities, {"ceiling": MountedCamera("ceiling", WORLD_FROM_DOWN)})
        )
        self.now = START
        self.given_up: list[tuple[float, str]] = []
        self.refused: list[Correction] = []
        for name in PLACES:
            self.filter.set_airborne(name, True, self.now, self.now)
        self.watch(2.0)
        assert self.given_up == []

    def watch(self, seconds: float, silent: str = "", unseen: bool = False, **displaced: tuple[float, float]) -> "Team":
        for tick in range(round(seconds * 100)):
            self.now += 10 * MS
            for name, (x, y) in PLACES.items():
                if name == silent:
                    continue
                self.filter.add_motion(name, OdometrySample(self.now, (0.0, 0.0, 0.0), 0.0, FLIGHT_M), self.now)
                if tick % 10 == 0 and not unseen:
                    dx, dy = displaced.get(name, (0.0, 0.0))
                    seen = (x + dx, -y - dy, 4.2 - FLIGHT_M)
                    assert (
                        self.filter.add_observation(
                            Measurement(self.now, "ceiling", name, seen, 0.0, COVARIANCE), name, self.now
                        )
                        is None
                    )
            self.filter.advance(self.now)
            for c in self.filter.take_corrections():
                if c.joined and c.nis is not None:
                    self.given_up.append(((self.now - START) / 1e9, c.subject))
                elif c.verdict is Verdict.IMPLAUSIBLE:
                    self.refused.append(c)
        return self

    def place(self, name: str) -> tuple[float, float]:
        x, y = self.filter.belief().mean_of(name)[:2]
        return float(x), float(y)


def test_a_robot_is_contradicted_until_it_is_believed_elsewhere() -> None:
    team, told = Team(), []
    for _ in range(15):
        team.watch(0.1, a=(0.8, 0.0))
        told.append(team.filter.contradicted("a"))
        assert not team.filter.contradicted("b")
    changes = [told[0], *(told[k] for k in range(1, 15) if told[k] != told[k - 1])]
    assert changes == [False, True, False], "from the second sighting on, until it is found"
    assert told.count(True) <= 7 and [name for _, name in team.given_up] == ["a"]


def test_a_robot_is_contradicted_no_longer_than_until_a_sighting_moves_it() -> None:
    """A value beyond the gate, but not far beyond, is used: from then on the belief follows the observations."""
    team = Team().watch(0.3, a=(0.8, 0.0))
    refused, (x, _) = len(team.refused), team.place("a")
    assert team.filter.contradicted("a")
    team.watch(0.1, a=(0.08, 0.0))
    assert len(team.refused) == refused and team.place("a")[0] > x + 0.01
    assert not team.filter.contradicted("a")


def test_a_camera_that_is_not_heeded_contradicts_for_a_moment_only() -> None:
    team = Team().watch(1.5, a=(0.8, 0.0), b=(0.8, 0.0))
    assert len(team.given_up) <= 1 and not any(team.filter.contradicted(name) for name in PLACES)


def test_a_robot_that_was_carried_off_is_found_at_once() -> None:
    team = Team().watch(1.5, a=(0.8, 0.0))
    assert [name for _, name in team.given_up] == ["a"]
    assert math.dist(team.place("a"), (-0.2, 0.0)) < 0.05
    assert math.dist(team.place("b"), PLACES["b"]) < 0.05


def test_sightings_long_ago_are_not_held_against_a_robot() -> None:
    team = Team().watch(0.4, a=(-1.2, 0.0)).watch(8.0, unseen=True).watch(0.1, a=(-1.2, 0.0))
    assert len(team.refused) == 5 and team.given_up == [], "the fifth, but one in a row"


@pytest.mark.parametrize("silent_s", [3.0, 10.0])
def test_one_that_was_carried_off_is_found_though_another_might_be_anywhere(silent_s: float) -> None:
    team = Team().watch(silent_s, silent="b").watch(1.5, silent="b", a=(-1.2, 0.0))
    assert [name for _, name in team.given_up] == ["a"]
    assert math.dist(team.place("a"), (-2.2, 0.0)) < 0.05


def test_a_marker_that_is_read_as_anothers_moves_nobody() -> None:
    team = Team().watch(3.0, a=(2.0, 0.3))
    assert team.given_up == [] and math.dist(team.place("a"), PLACES["a"]) < 0.1
    assert all("fits another entity" in c.reason for c in team.refused)


def test_a_camera_that_displaces_all_at_once_has_them_given_up_one_by_one() -> None:
    team = Team().watch(2.5, a=(0.8, 0.0), b=(0.8, 0.0))
    assert len(team.given_up) == 1, "the others stay where they were believed"
    kept = ({*PLACES} - {team.given_up[0][1]}).pop()
    assert math.dist(team.place(kept), PLACES[kept]) < 0.1
    assert any("lately had others given up" in c.reason for c in team.refused if c.subject == kept)
    team.watch(2.5, a=(0.8, 0.0), b=(0.8, 0.0))
    (first_s, one), (second_s, other) = team.given_up
    assert one != other and second_s - first_s >= 3.0, "if it insists for longer it is believed"


def test_a_camera_that_puts_one_robot_here_and_there_is_soon_heeded_no_more() -> None:
    team = Team()
    for turn in range(10):
        team.watch(1.0, a=(0.9, 0.0) if turn % 2 else (-0.9, 0.0))
    assert 2 <= len(team.given_up) <= 4, "three in a row, then one in ten seconds"
    assert math.dist(team.place("b"), PLACES["b"]) < 0.05, "who is seen right stays"


def test_years_of_rare_losses_are_never_held_against_anybody() -> None:
    team, place = Team(), 0.0
    for _ in range(5):
        place = 0.8 - place
        team.watch(11.0, a=(place, 0.0))
    assert len(team.given_up) == 5


def test_the_uncertain_time_of_a_sighting_counts_once_where_a_robot_is_found_again() -> None:
    """A camera without mounting errors sees a drone that passes at 1 m/s; stamps are right to 50 ms: 5 cm."""
    entities: dict[str, MotionModel] = {"a": OdometryRobot(), "eye": FixedMount((0.0, 0.0, 4.2), 1e-5, 1e-5)}
    camera = MountedCamera("eye", WORLD_FROM_DOWN, stamp_std_s=0.05)
    joint, now = FixedLagFilter(EstimatorParameters(entities, {"eye": camera})), START
    joint.set_airborne("a", True, now, now)
    for tick in range(120):
        now += 20 * MS
        x = (now - START) / 1e9 + (4.0 if tick >= 60 else 0.0)
        joint.add_motion("a", OdometrySample(now, (1.0, 0.0, 0.0), 0.0, FLIGHT_M), now)
        if tick % 3 == 0:
            joint.add_observation(Measurement(now, "eye", "a", (x, 0.0, 2.82), 0.0, COVARIANCE), "", now)
        joint.advance(now)
        if any(c.joined for c in joint.take_corrections()) and tick >= 60:
            break
    assert joint.belief().covariance_of("a")[0, 0] == pytest.approx(1e-4 + 0.05**2, rel=0.1)

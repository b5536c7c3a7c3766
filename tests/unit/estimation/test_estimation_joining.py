"""A first or re-initialising observation must agree with its observer wherever it has redundant information."""

import math

import numpy as np
import pytest

from groundstation.bus.messages import Verdict
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.chi_square import gate
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Correction, Measurement, OdometrySample
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.models.protocol import MotionModel
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters
from groundstation.geometry.rotations import base_from_tilted_optical

MS = 1_000_000
START = 10_000_000_000_000
TILTED = base_from_tilted_optical(math.radians(45))
UP = TILTED.T @ np.array((0.0, 0.0, 1.0))  # in the picture of a drone that hovers level
COVARIANCE = tuple(np.diag([1e-4, 1e-4, 1e-4, 1e-3]).ravel().tolist())
FLIGHT_M = 1.3
MARKER_M = 0.4
TOO_HIGH_M = 0.7


class Room:
    """A drone that hovers at the origin, located by the ceiling camera, before an unknown target."""

    def __init__(self) -> None:
        drone = OdometryRobot(marker_position_m=(0.0, 0.0, 0.0))
        entities: dict[str, MotionModel] = {
            "drone": drone,
            "rover": ConstantVelocityTarget(marker_height_m=MARKER_M),
            "ceiling": FixedMount((0.0, 0.0, 4.2), 0.004, 0.01),
        }
        cameras = {"ceiling": MountedCamera("ceiling", WORLD_FROM_DOWN), "drone": MountedCamera("drone", TILTED)}
        self.filter = FixedLagFilter(EstimatorParameters(entities, cameras))
        self.now = START
        self.filter.set_airborne("drone", True, self.now, self.now)

    def known(self) -> "Room":
        """Return the room after some observations of the drone by the ceiling camera."""
        for _ in range(10):
            self.run(0.1)
            self.below()
        self.run(0.05)
        return self

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            self.now += 10 * MS
            self.filter.add_motion("drone", OdometrySample(self.now, (0.0, 0.0, 0.0), 0.0, FLIGHT_M), self.now)
            self.filter.advance(self.now)

    def see(self, camera: str, subject: str, position: np.ndarray, yaw: float | None) -> Correction:
        covariance = COVARIANCE if yaw is not None else tuple(np.diag([1e-4] * 3).ravel().tolist())
        sight = Measurement(self.now, camera, subject, tuple(position.tolist()), yaw, covariance)
        assert self.filter.add_observation(sight, f"{camera}{subject}", self.now) is None
        self.filter.advance(self.now)
        return self.filter.take_corrections()[-1]

    def below(self, error: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Correction:
        """Add the ceiling camera's observation of the drone, displaced by an error [world]."""
        return self.see("ceiling", "drone", np.array((error[0], -error[1], 4.2 - FLIGHT_M - error[2])), 0.0)

    def ahead(self, x: float, y: float = 0.0, too_high_m: float = 0.0) -> Correction:
        """Add the drone's observation of the target at a place [world]."""
        return self.see("drone", "rover", TILTED.T @ np.array((x, y, MARKER_M + too_high_m - FLIGHT_M)), None)

    @property
    def belief(self) -> JointBelief:
        return self.filter.belief()

    def height_error_m(self, name: str) -> float:
        return float(self.belief.mean_of(name)[2]) - {"drone": FLIGHT_M, "ceiling": 4.2}[name]


def assert_same(before: JointBelief, after: JointBelief) -> None:
    np.testing.assert_array_equal(before.mean, after.mean)
    np.testing.assert_array_equal(before.covariance, after.covariance)


def test_a_first_sighting_of_a_target_that_contradicts_its_observer_changes_nothing() -> None:
    room = Room().known()
    before = room.belief
    refused = room.ahead(0.9, too_high_m=TOO_HIGH_M)
    assert refused.verdict is Verdict.IMPLAUSIBLE and "contradicts" in refused.reason and not refused.joined
    assert_same(before, room.belief)
    assert room.ahead(0.9).verdict is Verdict.ACCEPTED
    np.testing.assert_allclose(room.belief.mean_of("rover")[:2], (0.9, 0.0), atol=0.02)
    assert max(abs(room.height_error_m(name)) for name in ("drone", "ceiling")) < 0.01


def test_the_gate_is_that_of_the_surplus_row_alone() -> None:
    """The row along the vertical is orthogonal to the target's shift in the plane."""
    c = Room().known().ahead(0.9, 0.2, TOO_HIGH_M)
    variance = UP @ np.array(c.covariance).reshape(3, 3) @ UP
    assert c.nis == pytest.approx((UP @ np.array(c.residual)) ** 2 / variance, rel=1e-3)
    limit_m = math.sqrt(gate(0.997, 1) * variance)
    for share, verdict in ((0.97, Verdict.ACCEPTED), (1.03, Verdict.IMPLAUSIBLE)):
        for side in (-1.0, 1.0):
            assert Room().known().ahead(0.9, 0.2, side * share * limit_m).verdict is verdict


def test_sightings_that_keep_contradicting_the_observer_are_believed_with_care() -> None:
    """Like repeated contradictions of the subject: five in a row, over 0.6 s. They pull no further than a gate."""
    room = Room().known()
    spread_m = math.sqrt(room.belief.covariance_of("drone")[2, 2])
    verdicts: list[Verdict] = []
    while not verdicts or verdicts[-1] is Verdict.IMPLAUSIBLE:
        room.run(0.2)
        verdicts.append(room.ahead(0.9, too_high_m=0.3).verdict)
    assert verdicts[-1] is Verdict.INFLATED
    assert len(verdicts) == 5
    assert abs(room.height_error_m("drone")) < math.sqrt(gate(0.997, 1)) * spread_m
    assert abs(room.height_error_m("ceiling")) < 0.01
    assert math.sqrt(room.belief.covariance_of("rover")[:2, :2].max()) < 0.3


def test_contradictions_minutes_apart_are_not_in_a_row() -> None:
    room = Room().known()
    for pause_s in (0.2, 0.2, 0.2, 6.0, 0.2, 0.2, 0.2):
        room.run(pause_s)
        room.below()
        assert room.ahead(0.9, too_high_m=0.3).verdict is Verdict.IMPLAUSIBLE
    room.run(0.2)
    assert room.ahead(0.9, too_high_m=0.3).verdict is Verdict.INFLATED


def test_a_contradiction_does_not_count_once_the_target_has_joined() -> None:
    room = Room().known()
    for too_high_m in (TOO_HIGH_M, TOO_HIGH_M, TOO_HIGH_M, TOO_HIGH_M, 0.0, TOO_HIGH_M):
        room.run(0.2)
        verdict = room.ahead(0.9, too_high_m=too_high_m).verdict
    assert verdict is Verdict.IMPLAUSIBLE
    assert abs(room.height_error_m("drone")) < 0.01


def test_a_re_initialising_sighting_that_contradicts_its_observer_waits_for_the_next() -> None:
    """A target is carried off by 2 m; of the repeated observations, the one that would suffice is wrong."""
    room = Room().known()
    for _ in range(5):
        room.run(0.1)
        room.ahead(0.9)
    for _ in range(6):
        room.run(0.1)
        assert room.ahead(0.9, 2.0).verdict is Verdict.IMPLAUSIBLE
    room.run(0.1)
    before = room.belief
    assert room.ahead(0.9, 2.0, TOO_HIGH_M).verdict is Verdict.IMPLAUSIBLE
    assert_same(before, room.belief)
    room.run(0.1)
    assert room.ahead(0.9, 2.0).joined
    np.testing.assert_allclose(room.belief.mean_of("rover")[:2], (0.9, 2.0), atol=0.05)
    assert abs(room.height_error_m("drone")) < 0.01


@pytest.mark.parametrize("error", [(0.0, 0.0, 0.7), (0.7, -0.5, 0.6)])
def test_a_wild_first_sighting_of_a_robot_moves_no_mounting_and_gives_way_to_the_next(error: tuple) -> None:
    """It has a row for each of the robot's unknowns: none is left to give information about the camera."""
    room = Room()
    room.run(0.1)
    mounting = room.belief.mean_of("ceiling")
    assert room.below(error).joined
    np.testing.assert_allclose(room.belief.mean_of("ceiling"), mounting, atol=1e-9)
    room.run(0.1)
    assert room.below().joined
    room.run(0.1)
    assert room.below().verdict is Verdict.ACCEPTED
    np.testing.assert_allclose(room.belief.mean_of("ceiling"), mounting, atol=2e-3)
    np.testing.assert_allclose(room.belief.mean_of("drone")[:3], (0.0, 0.0, FLIGHT_M), atol=0.02)


def test_a_robot_that_was_carried_off_is_found_again_past_a_wild_sighting() -> None:
    room = Room().known()
    mounting = room.belief.mean_of("ceiling")
    moved = (0.8, 0.3, 0.0)
    sightings = [moved] * 6 + [(-1.0, 0.9, 0.7), moved, moved, moved]
    for error in sightings:
        room.run(0.1)
        room.below(error)
    np.testing.assert_allclose(room.belief.mean_of("drone")[:3], (0.8, 0.3, FLIGHT_M), atol=0.03)
    np.testing.assert_allclose(room.belief.mean_of("ceiling"), mounting, atol=3e-3)

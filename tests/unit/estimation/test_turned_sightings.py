"""Sightings whose place fits and whose heading does not: whether the vehicle's own heading or they are believed."""

import math

import numpy as np
import pytest

from groundstation.bus.messages import Verdict
from groundstation.estimation.event_log import TURNED
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Correction, Measurement, OdometrySample
from groundstation.estimation.models import FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.models.odometry_robot import AERIAL
from groundstation.estimation.models.protocol import MotionModel
from groundstation.estimation.parameters import EstimatorParameters

MS = 1_000_000
START = 10_000_000_000_000
COVARIANCE = tuple(np.diag([9e-6, 9e-6, 9e-6, math.radians(0.5) ** 2]).ravel().tolist())
HEIGHT_M, TURN_RAD_S = 1.3, 0.3


class Hall:
    """One drone flies a circle at a speed, in view of motion capture at 30 Hz.

    seen_rad and told_rad are added to its heading, as it is seen and as it reports it.
    """

    def __init__(self, speed_m_s: float = 0.3) -> None:
        robot = OdometryRobot(velocity_bias_std_m_s=0.03, slow_states=(*AERIAL, "velocity_bias_x", "velocity_bias_y"))
        entities: dict[str, MotionModel] = {"a": robot, "eye": FixedMount((0.0, 0.0, 0.0), 1e-3, 5e-3)}
        sensor = MountedCamera("eye", np.eye(3), sees_all_round=True, stamp_std_s=0.002)
        self.filter = FixedLagFilter(EstimatorParameters(entities, {"eye": sensor}))
        self.now, self.noise = START, np.random.default_rng(1)
        self.speed_m_s, self.yaw, self.place = speed_m_s, 0.0, np.zeros(2)
        self.seen_rad = self.told_rad = 0.0
        self.resets = 0
        self.filter.set_airborne("a", True, self.now, self.now)

    def fly(self, seconds: float) -> list[Correction]:
        corrections = []
        for tick in range(round(seconds * 100)):
            self.now += 10 * MS
            self.yaw += TURN_RAD_S * 0.01
            self.place += 0.01 * self.speed_m_s * np.array([math.cos(self.yaw), math.sin(self.yaw)])
            velocity = (self.speed_m_s + 0.01 * float(self.noise.standard_normal()), 0.0, 0.0)
            told = math.remainder(self.yaw + self.told_rad, math.tau)
            sample = OdometrySample(self.now, velocity, told, HEIGHT_M, reset=self.resets)
            self.filter.add_motion("a", sample, self.now)
            if tick % 3 == 0:
                x, y = (self.place + 0.003 * self.noise.standard_normal(2)).tolist()
                seen = math.remainder(self.yaw + self.seen_rad, math.tau)
                pose = Measurement(self.now, "eye", "a", (x, y, HEIGHT_M + 0.08), seen, COVARIANCE)
                self.filter.add_observation(pose, "", self.now)
            self.filter.advance(self.now)
            corrections += self.filter.take_corrections()
        return corrections

    @property
    def heading_error_deg(self) -> float:
        return math.degrees(abs(math.remainder(self.filter.belief().mean_of("a")[3] - self.yaw, math.tau)))

    @property
    def place_error_m(self) -> float:
        return float(np.linalg.norm(self.filter.belief().mean_of("a")[:2] - self.place))


@pytest.mark.parametrize("degrees", [180.0, 90.0, -60.0])
def test_a_body_that_is_turned_in_its_place_turns_nobody(degrees: float) -> None:
    hall = Hall()
    hall.fly(3.0)
    hall.seen_rad = math.radians(degrees)
    corrections = hall.fly(20.0)
    assert not any(c.joined for c in corrections)
    assert hall.heading_error_deg < 5.0 and hall.place_error_m < 0.02
    assert {(c.verdict, c.reason, len(c.residual)) for c in corrections} == {(Verdict.INFLATED, TURNED, 3)}
    hall.seen_rad = 0.0
    assert {c.verdict for c in hall.fly(2.0)} <= {Verdict.ACCEPTED, Verdict.INFLATED} and hall.heading_error_deg < 2.0


def test_a_vehicle_that_turned_while_its_own_heading_was_reset_is_believed_to_have_turned() -> None:
    hall = Hall()
    hall.fly(3.0)
    hall.yaw += math.radians(120.0)
    hall.resets = 1
    assert sum(c.joined for c in hall.fly(1.0)) == 1 and hall.heading_error_deg < 3.0


def test_a_heading_that_was_wrong_from_the_start_is_given_up_once_the_way_shows_it() -> None:
    hall = Hall()
    hall.seen_rad = math.pi
    hall.fly(3.0)
    assert hall.heading_error_deg > 170.0
    hall.seen_rad = 0.0
    hall.fly(1.5)
    assert hall.heading_error_deg < 3.0


def test_one_that_stood_is_found_as_soon_as_it_moves() -> None:
    hall = Hall(0.0)
    hall.seen_rad = math.pi
    hall.fly(3.0)
    hall.seen_rad = 0.0
    hall.fly(3.0)
    assert hall.heading_error_deg > 170.0, "nothing shows who is right, and nothing goes wrong"
    hall.speed_m_s = 0.3
    hall.fly(2.0)
    assert hall.heading_error_deg < 5.0


def test_a_jump_of_its_own_heading_that_passes_for_a_turn_is_not_believed() -> None:
    hall = Hall()
    hall.fly(3.0)
    hall.told_rad = math.radians(12.0)
    hall.fly(1.5)
    assert hall.heading_error_deg < 2.0

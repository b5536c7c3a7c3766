"""Time of an entity's last observation, and its position uncertainty then, whatever the belief since."""

import math

import numpy as np
import pytest

from groundstation.bus.messages import Verdict
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement, OdometrySample
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters

MS = 1_000_000
START = 5_000_000_000_000
NOISE = tuple(np.diag([1e-4, 1e-4, 4e-4, 1e-3]).ravel().tolist())
PARAMETERS = EstimatorParameters(
    {"a": OdometryRobot(), "t": ConstantVelocityTarget(), "ceiling": FixedMount((0.0, 0.0, 4.2), 0.0035, 0.01)},
    {"ceiling": MountedCamera("ceiling", WORLD_FROM_DOWN, observes_targets=False)},
)


def test_a_silent_robot_was_seen_as_well_as_it_was_though_its_belief_grows() -> None:
    joint = FixedLagFilter(PARAMETERS)
    joint.set_airborne("a", True, START, START)
    for turn in range(10):
        at = START + 100 * MS * turn
        assert joint.add_observation(Measurement(at, "ceiling", "a", (0.0, 0.0, 2.9), 0.0, NOISE), "", at) is None
        joint.advance(at)
    joint.advance(at + 200 * MS)
    wide = joint.belief().covariance_of("a")
    age_s, std_m = joint.sighting("a") or (math.inf, math.inf)
    assert age_s == pytest.approx(0.2, abs=1e-6)
    assert 0.005 < std_m < 0.03 and math.sqrt(wide[0, 0]) > 0.1


def test_a_robot_that_turned_as_it_fell_silent_is_believed_where_it_is_seen() -> None:
    """It has turned by 0.08 rad more at the next picture, which measures its heading to half a degree."""
    sharp = tuple(np.diag([1e-4, 1e-4, 4e-4, 1e-4]).ravel().tolist())
    joint = FixedLagFilter(PARAMETERS)
    joint.set_airborne("a", True, START, START)
    for turn in range(20):
        at, told = START + 100 * MS * turn, turn < 10
        for step in range(5 if told else 0):
            sample = OdometrySample(at + 20 * MS * (step - 4), (0.0, 0.0, 0.0), 0.015 * (turn + 0.2 * (step - 4)))
            joint.add_motion("a", sample, at)
        if told or turn >= 14:
            yaw = 0.015 * turn if told else 0.135 + 0.08
            joint.add_observation(Measurement(at, "ceiling", "a", (0.0, 0.0, 2.9), yaw, sharp), "", at)
        joint.advance(at)
    assert [one.verdict for one in joint.take_corrections()[-6:]] == [Verdict.ACCEPTED] * 6


def test_entities_never_seen_have_no_observation() -> None:
    joint = FixedLagFilter(PARAMETERS)
    joint.advance(START)
    assert joint.sighting("a") is None and joint.sighting("t") is None

"""When an entity was last seen, and how well its place was known then, whatever became of the belief since."""

import math

import numpy as np
import pytest

from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement
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


def test_who_was_never_seen_has_no_sighting() -> None:
    joint = FixedLagFilter(PARAMETERS)
    joint.advance(START)
    assert joint.sighting("a") is None and joint.sighting("t") is None

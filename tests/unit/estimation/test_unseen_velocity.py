"""The velocity error of an unobserved vehicle is a random walk, for the vehicle kinds that have one."""

import math

import numpy as np
import pytest

from groundstation.estimation.filter_state import Belief
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement
from groundstation.estimation.models import (
    ConstantVelocityTarget,
    FixedMount,
    ManoeuvringTarget,
    MountedCamera,
    OdometryRobot,
)
from groundstation.estimation.models.odometry_robot import SLOW_STATES
from groundstation.estimation.models.protocol import MotionModel
from groundstation.estimation.motion import predict
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters, parameters_from_field
from groundstation.estimation.tables import empty_state, tables_from_parameters
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

STEP_S = 0.01
BEGIN_NS = 5_000_000_000_000
NOISE = tuple(np.diag([1e-4, 1e-4, 4e-4, 1e-3]).ravel().tolist())
# Measured on a real PX4, each axis, after this time (docs/reference/mavlink.md 2.1): change of its velocity's error
# [m/s], and error of a position integrated from its velocity, less the velocity error when it was last observed [m].
MEASURED = {1.0: (0.15, 0.09), 2.0: (0.19, 0.24)}


def deviations(model: OdometryRobot, seconds: float) -> tuple[float, float]:
    """Return standard deviations of velocity error [m/s] and position [m] after a time unseen; both start exact."""
    tables = tables_from_parameters(EstimatorParameters({"one": model}))
    state = empty_state(tables, [True])
    state.memory["active"] = 1
    mean, P = state.means[0], np.zeros((state.means[0].size,) * 2)
    for _ in range(round(seconds / STEP_S)):
        state.memory["unseen_s"] += STEP_S  # as each step begins
        predict(Belief(mean, P, tables.entities[0], state.memory), STEP_S)
    at = model.labels.index("velocity_bias_x")
    return math.sqrt(P[at, at]), math.sqrt(P[0, 0])


def test_uncertainty_of_a_vehicle_on_our_estimate_matches_measured_drift() -> None:
    model = parameters_from_field(resolved_field(load_field(find_field("mixed-team")))).entities["drone_2"]
    assert isinstance(model, OdometryRobot)
    for seconds, (error_m_s, off_m) in MEASURED.items():
        velocity, place = deviations(model, seconds)
        assert velocity == pytest.approx(error_m_s, rel=0.25), seconds
        assert place == pytest.approx(off_m, rel=0.4), seconds


def test_a_kind_whose_error_does_not_walk_coasts_as_before() -> None:
    still = OdometryRobot(slow_states=SLOW_STATES, velocity_bias_std_m_s=0.03, velocity_bias_correlation_s=5.0)
    assert deviations(still, 1.0)[0] == pytest.approx(0.03 * math.sqrt(1.0 - math.exp(-0.4)))


def test_the_velocity_walk_begins_some_time_after_the_last_observation() -> None:
    walks = OdometryRobot(slow_states=SLOW_STATES, velocity_bias_std_m_s=0.03, velocity_walk=0.15)
    still = OdometryRobot(slow_states=SLOW_STATES, velocity_bias_std_m_s=0.03)
    assert deviations(walks, 0.15) == deviations(still, 0.15)


@pytest.mark.parametrize("target", [ConstantVelocityTarget(), ManoeuvringTarget()], ids=["one mode", "two modes"])
def test_time_unseen_passes_once_however_many_modes_the_target_has(target: MotionModel) -> None:
    """Between two pictures, 0.1 s apart, the error does not change."""
    deviation = []
    for walk in (0.0, 0.15):
        robot = OdometryRobot(slow_states=SLOW_STATES, velocity_bias_std_m_s=0.03, velocity_walk=walk)
        ceiling = FixedMount((0.0, 0.0, 4.2), 0.0035, 0.01)
        sensors = {"ceiling": MountedCamera("ceiling", WORLD_FROM_DOWN, observes_targets=False)}
        joint = FixedLagFilter(EstimatorParameters({"one": robot, "target": target, "ceiling": ceiling}, sensors))
        joint.set_airborne("one", True, BEGIN_NS, BEGIN_NS)
        for picture in range(10):
            at = BEGIN_NS + picture * 100_000_000
            joint.add_observation(Measurement(at, "ceiling", "one", (0.0, 0.0, 2.9), 0.0, NOISE), "", at)
            joint.advance(at)
        joint.advance(at + 150_000_000)
        deviation.append(joint.belief().covariance_of("one").trace())
    assert deviation[0] == pytest.approx(deviation[1], rel=1e-9)

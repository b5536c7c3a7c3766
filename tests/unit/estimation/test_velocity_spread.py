"""The covariance of a robot's velocity: that of its sensors' errors, in its own axes whatever its heading."""

import math
from dataclasses import replace

import numpy as np
import pytest

from groundstation.estimation.entity_estimate import entity_estimate
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement
from groundstation.estimation.models import (
    CommandedRobot,
    ConstantVelocityTarget,
    FixedMount,
    MountedCamera,
    OdometryRobot,
)
from groundstation.estimation.models.odometry_robot import SLOW_STATES
from groundstation.estimation.models.protocol import MotionModel
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters
from groundstation.estimation.records import EntityMemory
from groundstation.estimation.velocity_spread import robot_velocity_covariance
from groundstation.geometry.rotations import rotation_z

BEGIN_NS = 5_000_000_000_000
NOISE = tuple(np.diag([1e-4, 1e-4, 4e-4, 1e-3]).ravel().tolist())
ROBOT = OdometryRobot(
    slow_states=SLOW_STATES, velocity_bias_std_m_s=0.03, velocity_scale=2.0, velocity_std_m_s=0.05, reports_climb=True
)


def seen_robot(model: OdometryRobot = ROBOT) -> FixedLagFilter:
    sensors = {"ceiling": MountedCamera("ceiling", WORLD_FROM_DOWN)}
    parts: dict[str, MotionModel] = {
        "one": model,
        "cart": ConstantVelocityTarget(),
        "ceiling": FixedMount((0.0, 0.0, 4.2), 0.0035, 0.01),
    }
    joint = FixedLagFilter(EstimatorParameters(parts, sensors))
    joint.set_airborne("one", True, BEGIN_NS, BEGIN_NS)
    for picture in range(10):
        at = BEGIN_NS + picture * 100_000_000
        joint.add_observation(Measurement(at, "ceiling", "one", (0.0, 0.0, 2.9), 0.0, NOISE), "", at)
        joint.add_observation(Measurement(at, "ceiling", "cart", (0.5, 0.0, 3.9), 0.0, NOISE), "", at)
        joint.advance(at)
    return joint


def test_it_is_that_of_the_errors_of_the_velocity_alone() -> None:
    joint = seen_robot()
    labels = list(ROBOT.labels)
    covariance = np.zeros((len(labels),) * 2)
    for label, deviation in (
        ("velocity_bias_x", 0.1),
        ("velocity_bias_y", 0.2),
        ("climb", 0.3),
        ("yaw", 5.0),
        ("x", 9.0),
    ):
        covariance[labels.index(label), labels.index(label)] = deviation**2
    across = labels.index("velocity_bias_x"), labels.index("velocity_bias_y")
    covariance[across] = covariance[across[::-1]] = 0.01
    expected = np.diag([0.2**2 + 0.05**2, 0.4**2 + 0.05**2, 0.3**2])
    expected[0, 1] = expected[1, 0] = 4 * 0.01
    found = robot_velocity_covariance(joint, "one", covariance)
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.5])
def test_the_changes_that_a_model_tells_are_those_of_its_velocity(heading: float) -> None:
    memory = EntityMemory.rows(1)[0]
    memory["held_vx"], memory["held_vy"], memory["slow_vx"], memory["slow_vy"] = 0.4, -0.2, 0.3, -0.1
    for model in (ROBOT, CommandedRobot()):
        block = np.zeros(len(model.labels))
        block[model.labels.index("yaw")] = heading
        before = np.array(model.velocity_m_s(block, memory))
        for label, change in model.velocity_errors(memory).items():
            wrong = block.copy()
            wrong[model.labels.index(label)] += 0.01
            found = rotation_z(-heading) @ (np.array(model.velocity_m_s(wrong, memory)) - before) / 0.01
            assert found == pytest.approx(change, abs=1e-9), label


def test_of_a_model_that_does_not_tell_it_is_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    joint = seen_robot()
    monkeypatch.delattr(OdometryRobot, "velocity_errors")
    assert entity_estimate(joint, joint.belief(), "one", True, 0.0, 0.0).velocity_covariance is None


def test_estimates_tell_it_of_robots_and_targets() -> None:
    joint = seen_robot()
    belief = joint.belief()
    robot, cart = (entity_estimate(joint, belief, name, True, 0.0, 0.0) for name in ("one", "cart"))
    assert robot.velocity_covariance is not None and cart.velocity_covariance is not None
    own = np.reshape(robot.velocity_covariance, (3, 3))
    assert np.linalg.eigvalsh(own).min() > 0.0 and own[0, 0] >= 0.05**2
    assert cart.velocity_covariance == tuple(belief.covariance_of("cart")[2:4, 2:4].ravel().tolist())


def test_a_vehicle_that_measures_its_velocity_worse_is_known_worse() -> None:
    spreads = []
    for deviation in (0.05, 0.3):
        joint = seen_robot(replace(ROBOT, velocity_std_m_s=deviation))
        told = entity_estimate(joint, joint.belief(), "one", True, 0.0, 0.0).velocity_covariance
        assert told is not None
        spreads.append(math.sqrt(told[0]))
    assert spreads[1] > 3 * spreads[0]

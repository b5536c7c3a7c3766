"""A robot whose target left its picture regains it by turning to it and backing off."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.bus.messages import SolverReport
from groundstation.control.moment import Sight
from groundstation.control.parameters import control_from_field
from groundstation.control.regaining import regaining
from groundstation.control.setpoints import Setpoint, setpoints_from_plan
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.planning.planner import PlanResult
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.topology import Topology
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

LAB = resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml"))
IN_LAB, CONTROL = sensors_from_field(LAB), control_from_field(LAB)
SENSORS = replace(IN_LAB, marker_height_m={**IN_LAB.marker_height_m, "gone": 0.4})
HELD = {"drone_1": np.array([0.2, -0.1, 0.3]), "drone_2": np.array([0.0, 0.1, -0.2])}


def belief(first: np.ndarray, target: np.ndarray, target_std: float = 0.05) -> JointBelief:
    layout = StateLayout().with_entity("drone_1", EntityKind.ROBOT, ROBOT_CORE)
    layout = layout.with_entity("drone_2", EntityKind.ROBOT, ROBOT_CORE)
    layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
    mean = np.concatenate((first, (-2.0, 0.0, 1.6, 0.0), target))
    return JointBelief(mean, np.diag([0.03**2] * 8 + [target_std**2] * 4), layout, 0)


def wanted(
    now: JointBelief,
    age_s: float | None,
    topology: str,
    missing: tuple[str, ...] = (),
    unsteered: tuple[str, ...] = (),
) -> dict[str, Setpoint]:
    report = SolverReport("complete", 1, 0.0, 1, 1)
    heights = {"drone_1": 1.6, "drone_2": 1.6}
    plan = PlanResult(Topology.parse(topology), 0.1, 0.1, HELD, heights, (), (), report, "multistart", 0)
    sight = Sight(age_s, missing=missing, unsteered=unsteered)
    return setpoints_from_plan(plan, now, ("drone_1", "drone_2"), CONTROL, SENSORS, sight)


@pytest.mark.parametrize("start", [(-0.2, 0.0, 1.6, 0.3), (0.6, 0.1, 1.6, 2.0), (-1.3, 0.5, 1.6, -1.0)])
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (-0.3, 0.1)])
def test_within_three_seconds_the_target_is_well_inside_the_picture_and_stays(
    start: tuple[float, ...], velocity: tuple[float, float]
) -> None:
    drone, target, dt = np.array(start), np.array([0.5, 0.0, *velocity]), 0.05
    margins = []
    for tick in range(100):
        found = regaining("drone_1", "turtlebot", belief(drone, target), SENSORS)
        assert found is not None
        (vx, vy), rate = found
        c, s = math.cos(drone[3]), math.sin(drone[3])
        drone += dt * np.array([c * vx - s * vy, s * vx + c * vy, 0.0, max(-1.05, min(1.05, rate))])
        target[:2] += dt * target[2:]
        if tick >= 60:
            point = np.array([*target[:2], 0.4])
            margins.append(SENSORS.onboard["drone_1"].view.margin(SENSORS.onboard["drone_1"].optical(drone, point)))
    assert min(margins) > 0.1


def test_a_robot_that_sees_its_target_flies_the_plan() -> None:
    out = wanted(belief(np.array([0.0, 0.0, 1.6, 0.0]), np.array([0.5, 0.0, 0.0, 0.0])), 0.3, "drone_1,drone_2")
    assert out["drone_1"].velocity_m_s[:2] == pytest.approx((0.2, -0.1))


def test_one_that_does_not_backs_off_turns_and_keeps_its_height() -> None:
    out = wanted(belief(np.array([0.0, 0.0, 1.6, 0.2]), np.array([0.5, 0.0, 0.0, 0.0])), 0.5, "drone_1,drone_2")
    vx, _, vz = out["drone_1"].velocity_m_s
    assert vx < -0.4
    assert out["drone_1"].yaw_rate_rad_s == pytest.approx(-0.4)
    assert vz == pytest.approx(0.0)


def test_a_relaying_robot_keeps_its_plan() -> None:
    out = wanted(belief(np.array([0.0, 0.0, 1.6, 0.2]), np.array([0.5, 0.0, 0.0, 0.0])), 0.5, "drone_2/drone_1")
    assert out["drone_1"].velocity_m_s[0] < -0.4
    assert out["drone_2"].velocity_m_s[:2] == pytest.approx((0.0, 0.1))


def test_the_nearest_gets_back_what_the_lowest_level_cannot_reach() -> None:
    """drone_2 is the lowest and 5 m away; a topology assigns observers, whatever they can see."""
    far = wanted(belief(np.array([2.4, 0.0, 1.6, 0.2]), np.array([3.0, 0.0, 0.0, 0.0])), 0.5, "drone_1/drone_2")
    assert far["drone_1"].velocity_m_s[0] < -0.2
    assert far["drone_2"].velocity_m_s[:2] == pytest.approx((0.0, 0.1))
    nobody = wanted(belief(np.array([0.5, 0.0, 1.6, 0.2]), np.array([4.0, 0.0, 0.0, 0.0])), 0.5, "drone_1/drone_2")
    assert nobody["drone_1"].velocity_m_s[:2] == pytest.approx((0.2, -0.1))


def test_the_next_gets_back_what_one_that_follows_no_setpoints_does_not() -> None:
    now = belief(np.array([-1.2, 0.5, 1.6, 0.2]), np.array([-1.2, 0.6, 0.0, 0.0]))
    for held, moves in ((("drone_2",), "drone_1"), (("drone_1",), "drone_2")):
        out = wanted(now, 0.5, "drone_1/drone_2" if held == ("drone_2",) else "drone_2/drone_1", unsteered=held)
        assert out[moves].yaw_rate_rad_s != pytest.approx(HELD[moves][2])
        assert out[held[0]].yaw_rate_rad_s == pytest.approx(HELD[held[0]][2])


def test_a_place_that_is_known_badly_is_looked_at_from_farther_away() -> None:
    drone, target = np.array([-0.7, 0.0, 1.6, 0.0]), np.array([0.5, 0.0, 0.0, 0.0])
    sharp, vague = (regaining("drone_1", "turtlebot", belief(drone, target, std), SENSORS) for std in (0.02, 0.3))
    assert sharp is not None
    assert vague is not None
    assert vague[0][0] < sharp[0][0]


def test_a_target_that_is_searched_for_is_not_taken_for_the_one_that_left_the_picture() -> None:
    with_one = belief(np.array([0.0, 0.0, 1.6, 0.0]), np.array([0.5, 0.0, 0.0, 0.0]))
    layout = with_one.layout.with_entity("gone", EntityKind.TARGET, TARGET_CORE)
    P = np.eye(layout.dim) * 1e-3
    both = JointBelief(np.append(with_one.mean, (0.0, 0.4, 0.0, 0.0)), P, layout, 0)
    tracked, nearest = (wanted(both, 0.5, "drone_2/drone_1", missing) for missing in (("gone",), ()))
    assert abs(tracked["drone_1"].yaw_rate_rad_s) < 0.01
    assert nearest["drone_1"].yaw_rate_rad_s > 1.0

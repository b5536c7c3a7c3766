"""Robots that fly on our estimate turn back once nothing locates them, and land before their position is lost."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from groundstation.bus.messages import SolverReport
from groundstation.control.flight_mode import FlightMode
from groundstation.control.moment import Sight
from groundstation.control.parameters import control_from_field
from groundstation.control.setpoints import Setpoint, setpoints_from_plan
from groundstation.control.stand import Stand
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.geometry.stabilized_frame import stabilized_from_world, world_from_stabilized
from groundstation.planning.planner import PlanResult
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.topology import Topology
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

FIELD = resolved_field(load_field(Path(__file__).parents[3] / "config/mixed-team.yaml"))
SENSORS, CONTROL = sensors_from_field(FIELD), control_from_field(FIELD)
TICK_S, LAG_S, DELAY_S = 0.02, 0.5, 0.2
# Figures of a real PX4 (SIH): its belief out of view, and its driver's stop and landing.
SEEN_STD_M, GROWTH_M_S, NEEDED_STD_M, HOVERS_S, LANDS_S = 0.02, 0.08, 0.07, 0.3, 0.7
TARGET = (1.0, 0.45, 0.2, 0.05)


def belief(pose: np.ndarray, std_m: float, name: str = "drone_2") -> JointBelief:
    layout = StateLayout().with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
    layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
    return JointBelief(np.array([*pose, *TARGET]), std_m**2 * np.eye(8), layout, 0)


def plan(velocity: np.ndarray, pose: np.ndarray, name: str = "drone_2", climb_m: float = 0.0) -> PlanResult:
    body = stabilized_from_world(np.append(velocity, 0.0), float(pose[3]))
    return PlanResult(
        topology=Topology.parse(name), cost=0.1, uncertainty=0.1, controls={name: np.array([body[0], body[1], 0.0])},
        heights={name: float(pose[2]) + climb_m}, edges=(), alternatives=(), mode="multistart", stamp_ns=0,
        solver=SolverReport("complete", 1, 0.0, 1, 1),
    )  # fmt: skip


def told(pose: np.ndarray, velocity: np.ndarray, sight: Sight, std_m: float, name: str = "drone_2") -> Setpoint:
    found = setpoints_from_plan(plan(velocity, pose, name), belief(pose, std_m, name), (name,), CONTROL, SENSORS, sight)
    assert found[name].phase is FlightMode.TRACK
    return found[name]


def seen(pose: np.ndarray) -> bool:
    marker = SENSORS.marker("drone_2", pose, is_robot=True)
    return any(SENSORS.world_in_view(camera, marker) for camera in SENSORS.world)


class Flight:
    """A vehicle that follows velocities with a lag, its belief, and its driver's reaction."""

    def __init__(self, place: tuple[float, ...], velocity: tuple[float, float]) -> None:
        self.pose, self.velocity = np.array([*place, 0.7]), np.array(velocity)
        self.tied_s = self.lost_s = 0.0

    def step(self, planned: tuple[float, float]) -> bool:
        """Return whether it flies on; its driver lands it before its position is too uncertain."""
        unseen_s = self.tied_s + DELAY_S
        sight = Sight(
            0.1, {"drone_2": unseen_s}, untied_s={"drone_2": unseen_s},
            velocities_m_s={"drone_2": np.append(self.velocity, 0.0)},
        )  # fmt: skip
        std_m = SEEN_STD_M + GROWTH_M_S * self.tied_s
        out = told(self.pose, np.array(planned), sight, std_m).velocity_m_s
        wanted = world_from_stabilized(np.array(out), float(self.pose[3]))[:2]
        self.lost_s = self.lost_s + TICK_S if std_m > NEEDED_STD_M else 0.0
        self.velocity += TICK_S / LAG_S * ((wanted if self.lost_s < HOVERS_S else np.zeros(2)) - self.velocity)
        self.pose[:2] += TICK_S * self.velocity
        self.tied_s += TICK_S
        return self.lost_s < LANDS_S


@pytest.mark.parametrize(
    ("place", "velocity", "planned"),
    [
        ((-0.29, -0.52, 1.31), (0.12, -0.38), (0.16, -0.10)),
        ((-0.14, -0.59, 1.17), (0.14, -0.03), (0.00, 0.17)),
        ((-0.15, -0.72, 1.06), (0.27, -0.01), (-0.30, 0.10)),
    ],
    ids=[
        "it left the view and saw nothing itself",
        "the one that saw the same target left the view too",
        "its plan turned round in the midst of the gap",
    ],
)
def test_a_robot_out_of_view_returns_before_it_is_landed(
    place: tuple[float, ...], velocity: tuple[float, float], planned: tuple[float, float]
) -> None:
    """Positions, velocities and plans of three flights of a PX4 in step with the room that ended in a landing."""
    flight = Flight(place, velocity)
    while not seen(flight.pose):
        assert flight.step(planned), f"landed {flight.tied_s:.1f} s after it was last seen, at {flight.pose[:2]}"
    assert flight.tied_s > 0.4


def test_it_turns_back_at_full_speed_whatever_drift_was_measured_of_it() -> None:
    """A copter that returned at only 0.05 m/s, because of an earlier drift, landed at the border of the view."""
    sight = Sight(0.1, {"drone_2": 0.6}, untied_s={"drone_2": 0.6}, drifts_m_s={"drone_2": np.array([-0.2, 0.0, 0.0])})
    out = told(np.array([-0.31, -0.4, 1.25, 0.7]), np.array([0.1, 0.1]), sight, SEEN_STD_M).velocity_m_s
    assert world_from_stabilized(np.array(out), 0.7)[0] == pytest.approx(-CONTROL.return_speed_m_s)


def test_it_goes_on_inwards_where_it_is_believed_in_view_and_not_seen() -> None:
    """A robot that is not seen in the middle of a view is not there: its belief follows a wrong velocity."""
    sight = Sight(0.1, {"drone_2": 0.8}, untied_s={"drone_2": 0.8})
    out = told(np.array([-0.75, -0.4, 1.2, 0.7]), np.array([0.3, -0.2]), sight, SEEN_STD_M).velocity_m_s
    wanted = world_from_stabilized(np.array(out), 0.7)
    assert wanted[0] == pytest.approx(-CONTROL.return_speed_m_s) and wanted[1] > 0.3


def test_a_robot_in_the_view_makes_room_for_a_returning_one() -> None:
    """A real PX4 stood still in front of the view, 3 cm from its border: another vehicle kept it off."""
    here, there = np.array([-0.5, -0.3, 1.3, 0.0]), np.array([-1.2, -0.1, 1.3, 0.0])
    layout = StateLayout().with_entity("drone_2", EntityKind.ROBOT, ROBOT_CORE)
    layout = layout.with_entity("drone_1", EntityKind.ROBOT, ROBOT_CORE)
    layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
    both = JointBelief(np.array([*here, *there, *TARGET]), SEEN_STD_M**2 * np.eye(12), layout, 0)
    plans = plan(np.zeros(2), here)
    plans = replace(
        plans, controls={**plans.controls, "drone_1": np.zeros(3)}, heights={**plans.heights, "drone_1": 1.3}
    )
    for untied_s, away_m_s in ((0.3, 0.0), (0.5, -0.2)):
        sight = Sight(0.1, {"drone_2": untied_s}, untied_s={"drone_2": untied_s})
        told_to = setpoints_from_plan(plans, both, ("drone_1", "drone_2"), CONTROL, SENSORS, sight)
        away = told_to["drone_1"].velocity_m_s[0]
        assert away == pytest.approx(0.0) if untied_s < 0.4 else away <= away_m_s
        assert told_to["drone_2"].velocity_m_s[0] == pytest.approx(0.0 if untied_s < 0.4 else -0.5)


@pytest.mark.parametrize(("untied_s", "climbs"), [(0.3, True), (0.5, False)])
def test_it_does_not_climb_out_of_the_view_that_it_looks_for(untied_s: float, climbs: bool) -> None:
    """The view's border receded before a real PX4: it rose from 1.17 to 1.44 m, where the view is narrower."""
    pose, sight = np.array([-0.8, -0.3, 1.17, 0.7]), Sight(0.1, {"drone_2": untied_s}, untied_s={"drone_2": untied_s})
    found = setpoints_from_plan(
        plan(np.zeros(2), pose, climb_m=0.9), belief(pose, SEEN_STD_M), ("drone_2",), CONTROL, SENSORS, sight
    )
    assert found["drone_2"].velocity_m_s[2] == pytest.approx(0.4 if climbs else -0.18)


def test_a_robot_located_by_its_own_observations_flies_its_plan() -> None:
    pose = np.array([-0.1, -0.55, 1.4, 0.7])
    sight = Sight(0.1, {"drone_2": 3.0}, untied_s={"drone_2": 0.3}, helped_s={"drone_2": 0.3})
    out = told(pose, np.array([0.3, 0.1]), sight, SEEN_STD_M).velocity_m_s
    assert world_from_stabilized(np.array(out), 0.7)[:2] == pytest.approx([0.3, 0.1])


def test_a_vehicle_with_its_own_position_flies_on_out_of_view() -> None:
    pose = np.array([-0.1, 0.55, 1.3, 0.7])
    sight = Sight(0.1, {"drone_1": 1.0}, untied_s={"drone_1": 1.0})
    out = told(pose, np.array([0.3, 0.1]), sight, SEEN_STD_M, "drone_1").velocity_m_s
    assert world_from_stabilized(np.array(out), 0.7)[:2] == pytest.approx([0.3, 0.1])


@pytest.mark.parametrize("x", [-0.02, 0.02])
def test_between_two_views_it_goes_on_to_the_one_that_it_flies_to(x: float) -> None:
    """The nearest view changes with each estimate, and it would stay between them until it lands."""
    sight = Sight(
        0.1, {"drone_2": 1.0}, untied_s={"drone_2": 1.0}, velocities_m_s={"drone_2": np.array([0.2, 0.0, 0.0])}
    )
    out = told(np.array([x, -0.3, 1.3, 0.7]), np.array([-0.2, 0.0]), sight, SEEN_STD_M).velocity_m_s
    assert world_from_stabilized(np.array(out), 0.7)[0] > 0.95 * CONTROL.limits_of("drone_2").max_speed_m_s


@pytest.mark.parametrize("x", [-0.02, 0.02])
def test_on_the_way_back_it_goes_on_to_the_view_that_it_flies_to(x: float) -> None:
    pose = np.array([x, -0.3, 1.5, 0.0])
    sight = Sight(0.1, {"drone_2": 20.0}, velocities_m_s={"drone_2": np.array([0.2, 0.0, 0.0])})
    out = setpoints_from_plan(None, belief(pose, 0.05), ("drone_2",), CONTROL, SENSORS, sight)["drone_2"]
    assert out.phase is FlightMode.RETURN
    assert out.velocity_m_s[0] > 0.3


def test_a_vehicle_on_our_estimate_stops_before_leaving_all_views() -> None:
    """Copters that searched for the target left the views at 0.5 m/s, and landed before they were back."""
    near, tied = np.array([-1.7, -0.70, 1.2, 0.0]), Sight(0.1, untied_s={"drone_2": 0.1})
    border_m = min(view.y_m[0] for view in SENSORS.root_views(1.2 + SENSORS.marker_height_m["drone_2"]))
    for name, slowest in (("drone_2", border_m + 0.70), ("drone_1", -0.5)):
        out = told(near, np.array([0.1, -0.5]), tied, SEEN_STD_M, name).velocity_m_s
        assert out[:2] == pytest.approx([0.1, slowest])


def test_a_plan_does_not_lift_it_out_of_the_views_and_brings_it_inside_first() -> None:
    """Three times of three a real PX4 that took off towards the border was lifted over it, and landed 3 s after TRACK.

    Its own velocity was off by 0.35 m/s by then, as much as the hold at a border can correct.
    """
    tied = Sight(0.1, untied_s={"drone_2": 0.1})
    views = SENSORS.root_views(1.5 + SENSORS.marker_height_m["drone_2"])
    border_m = min(view.y_m[0] for view in views)
    for y, name, climb, inwards in (
        (-0.79, "drone_2", 0.0, border_m + 0.79),
        (-0.55, "drone_2", 0.4, 0.01),
        (-0.79, "drone_1", 0.4, 0.01),
    ):
        pose = np.array([-1.37, y, 0.83, 0.0])
        plans = plan(np.array([0.3, 0.01]), pose, name, climb_m=0.67)
        found = setpoints_from_plan(plans, belief(pose, SEEN_STD_M, name), (name,), CONTROL, SENSORS, tied)[name]
        assert found.velocity_m_s == pytest.approx((0.3, inwards, climb))


@pytest.mark.parametrize(("name", "aside"), [("drone_2", -0.12), ("drone_1", -0.25)])
def test_it_does_not_step_out_of_the_views_to_climb_past_another(name: str, aside: float) -> None:
    """A real PX4 that took off 0.7 m from another drone stepped aside at 0.3 m/s, over the border 0.3 m from it."""
    here, there = np.array([-1.7, -0.52, 0.83, 0.0]), np.array([-1.7, 0.2, 0.8, 0.0])
    layout = StateLayout().with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
    layout = layout.with_entity("drone_3", EntityKind.ROBOT, ROBOT_CORE)
    layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
    both = JointBelief(np.array([*here, *there, *TARGET]), SEEN_STD_M**2 * np.eye(12), layout, 0)
    plans = plan(np.zeros(2), here, name, climb_m=0.67)
    plans = replace(
        plans, controls={**plans.controls, "drone_3": np.zeros(3)}, heights={**plans.heights, "drone_3": 0.8}
    )
    tied = Sight(0.1, untied_s={"drone_2": 0.1, "drone_3": 0.1})
    found = setpoints_from_plan(plans, both, (name, "drone_3"), CONTROL, SENSORS, tied)[name]
    assert found.blocked == "drone_3"
    assert found.velocity_m_s == pytest.approx((0.0, aside, 0.0), abs=0.01)


def test_brought_inside_it_climbs_on() -> None:
    """Like the one above, in the middle of a view, while its plan still leads outwards."""
    pose, tied, lag_s = np.array([-1.2, -0.74, 0.83, 0.0]), Sight(0.1, untied_s={"drone_2": 0.1}), 0.67
    velocity, turns = np.array([0.1, -0.2, 0.0]), 0
    while pose[2] < 1.4:
        plans = plan(np.array([0.0, -0.3]), pose, climb_m=1.5 - pose[2])
        found = setpoints_from_plan(plans, belief(pose, SEEN_STD_M), ("drone_2",), CONTROL, SENSORS, tied)["drone_2"]
        velocity += TICK_S / lag_s * (np.array(found.velocity_m_s) - velocity)
        pose[:3] += TICK_S * velocity
        turns += 1
        assert seen(pose) and turns * TICK_S < 4.0, (turns, pose)


def test_a_search_does_not_lift_it_out_of_its_view() -> None:
    """Views are narrower at the height of a search."""
    for y, rises in ((-0.1, True), (-0.85, False)):
        pose = np.array([-1.7, y, 1.1, 0.0])
        found = setpoints_from_plan(None, belief(pose, SEEN_STD_M), ("drone_2",), CONTROL, SENSORS, Sight(9.0))
        assert found["drone_2"].phase is FlightMode.SEARCH
        assert (found["drone_2"].velocity_m_s[2] > 0.0) is rises


def test_it_searches_in_its_view_until_it_has_risen_to_the_height_of_a_search() -> None:
    """Sent out of its view while low it never rose, saw little of the floor, and sank at each border."""
    sight = Sight(9.0, search=lambda robots, targets: {name: Stand(-1.7, -2.5, 0.0) for name in robots})
    for height_m, goes_out in ((0.9, False), (CONTROL.search_height_m - 0.1, True)):
        pose = np.array([-1.7, -0.25, height_m, 0.0])
        found = setpoints_from_plan(None, belief(pose, SEEN_STD_M), ("drone_2",), CONTROL, SENSORS, sight)["drone_2"]
        assert found.phase is FlightMode.SEARCH
        assert (found.velocity_m_s[1] < -0.2) is goes_out
        assert found.velocity_m_s[2] > 0.1


def test_a_searching_robot_without_position_updates_returns() -> None:
    pose, sight = np.array([-1.7, -0.9, 1.2, 0.0]), Sight(9.0, {"drone_2": 0.5}, untied_s={"drone_2": 0.5})
    found = setpoints_from_plan(None, belief(pose, SEEN_STD_M), ("drone_2",), CONTROL, SENSORS, sight)
    assert found["drone_2"].phase is FlightMode.RETURN
    assert found["drone_2"].velocity_m_s[1] > 0.2 and found["drone_2"].velocity_m_s[2] < 0.0


def test_a_way_is_kept_in_sight_as_far_as_the_plans_of_the_field_reach() -> None:
    assert CONTROL.planned_s == pytest.approx(FIELD.planner.horizon_steps * FIELD.planner.step_s) == pytest.approx(3.0)
    near = control_from_field(
        msgspec.structs.replace(FIELD, planner=msgspec.structs.replace(FIELD.planner, step_s=0.1))
    )
    assert near.planned_s == pytest.approx(1.0)

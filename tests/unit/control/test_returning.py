"""The return into a world-fixed view starts early enough."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.control.excursion import Excursions, time_left_s, within_reach
from groundstation.control.flight_mode import FlightMode
from groundstation.control.moment import Sight
from groundstation.control.parameters import control_from_field
from groundstation.control.returning import is_lost, return_stand
from groundstation.control.search_parameters import search_from_field
from groundstation.control.setpoints import setpoints_from_plan
from groundstation.control.view import VIEW_INSET_M, velocity_error_m_s, view_of, way_back_m
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.models import Rectangle
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

LAB = resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml"))
SENSORS, CONTROL = sensors_from_field(LAB), control_from_field(LAB)
VIEW = Rectangle((-1.0, 1.0), (-0.5, 0.5))
TICK_S = 0.02
LAG_S = 0.5


def belief(pose: np.ndarray, std_m: float = 0.1) -> JointBelief:
    layout = StateLayout().with_entity("drone_1", EntityKind.ROBOT, ROBOT_CORE)
    layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
    return JointBelief(np.array([*pose, 0.0, 0.0, 0.0, 0.0]), std_m**2 * np.eye(8), layout, 0)


def test_the_way_back_ends_where_it_enters_the_view() -> None:
    ways = {
        (0.0, 0.0): 0.0,
        (1.0, 0.5): 0.0,
        (3.0, 0.0): 2.0,
        (0.0, -2.5): 2.0,
        (2.0, 1.0): math.hypot(1.0, 0.5),
        (-2.0, 2.0): math.hypot(2.0, 2.0) * 0.75,
    }
    assert way_back_m(np.array(list(ways)), VIEW) == pytest.approx(list(ways.values()))


def test_a_robot_flies_back_before_its_height_is_too_uncertain() -> None:
    outside = np.array([3.0, 2.0, 1.3, 0.0])
    for height_std_m, back in ((0.1, False), (1.1 * CONTROL.return_std_m, True)):
        variances = np.full(8, 0.1**2)
        variances[2] = height_std_m**2
        at = replace(belief(outside), covariance=np.diag(variances))
        assert is_lost("drone_1", at, CONTROL, SENSORS) == back


def test_without_a_view_a_missed_robot_turns_where_it_is() -> None:
    """A circle about its own place, which moves with it, never closed: it flew across the room."""
    stand = return_stand(np.array([1.0, -0.5, 1.2, 0.3]), None, 12.0)
    assert (stand.x, stand.y) == (1.0, -0.5) and stand.yaw_rate > 0.3
    around = return_stand(np.array([1.0, -0.5, 1.2, 0.3]), VIEW, 12.0)
    assert math.hypot(around.x, around.y) > 0.4


@pytest.mark.parametrize(("limit_m_s", "speed_m_s"), [(0.6, 0.5), (0.2, 0.2)])
def test_returns_and_searches_count_on_no_more_than_the_slowest_drone_flies(limit_m_s: float, speed_m_s: float) -> None:
    set_to = (f"drones.drone_2.limits.max_speed_m_s={limit_m_s}",)
    field = resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml", set_to))
    control = control_from_field(field)
    assert control.return_speed_m_s == control.search_speed_m_s == speed_m_s
    assert search_from_field(field).speed_m_s == speed_m_s


def test_the_way_back_into_a_view_without_width_is_that_to_its_middle() -> None:
    assert float(way_back_m(np.array([3.0, 4.0]), Rectangle((0.0, 0.0), (0.0, 0.0)))) == pytest.approx(5.0, abs=1e-5)


def test_uncertainty_and_drift_shorten_the_time_out_of_view() -> None:
    fresh, known_worse = time_left_s(0.05, 0.0, CONTROL), time_left_s(0.3, 0.0, CONTROL)
    drifting = time_left_s(0.3, 4.0, CONTROL)  # 0.25 m in 4 s
    assert fresh == pytest.approx(min((CONTROL.return_limit_m - 0.05) / CONTROL.drift_m_s, CONTROL.return_within_s))
    assert fresh > known_worse > drifting
    assert drifting == pytest.approx((CONTROL.return_limit_m - 0.3) / 0.0625)
    assert time_left_s(0.1, 14.0, CONTROL) == pytest.approx(1.0)  # odometry may be worse than its stated accuracy


def test_a_drone_far_out_flies_back_by_its_uncertainty_and_its_way() -> None:
    far, near = np.array([3.4, 0.0, 1.6, 0.0]), np.array([0.0, 0.0, 1.6, 0.0])
    assert is_lost("drone_1", belief(far, 0.3), CONTROL, SENSORS, unseen_s=4.0)
    assert not is_lost("drone_1", belief(far, 0.1), CONTROL, SENSORS, unseen_s=4.0)
    assert is_lost("drone_1", belief(far, 0.1), CONTROL, SENSORS, unseen_s=10.0)
    assert not is_lost("drone_1", belief(near, 0.1), CONTROL, SENSORS, unseen_s=10.0)


def test_a_drone_on_its_way_back_is_not_turned_round_by_an_estimate_that_wavers() -> None:
    """Its way and its time left shrink alike: at the border it returned and searched in turns."""
    far, unseen = belief(np.array([3.4, 0.0, 1.6, 0.0]), 0.1), np.arange(4.0, 10.0, 0.01)
    border_s = next(s for s in unseen if is_lost("drone_1", far, CONTROL, SENSORS, unseen_s=s))
    for aside_m in (-0.1, 0.1):
        wavered = belief(np.array([3.4 + aside_m, 0.0, 1.6, 0.0]), 0.1)
        assert is_lost("drone_1", wavered, CONTROL, SENSORS, unseen_s=border_s, returns=True)
    assert not is_lost("drone_1", far, CONTROL, SENSORS, unseen_s=border_s - 2.0, returns=True)


@pytest.mark.parametrize("rotation_deg", [(0, 8.5, 0), (25, 0, 0), (0, -30, 40)])
def test_a_drone_flies_back_into_the_view_of_a_tilted_camera(rotation_deg: tuple[float, float, float]) -> None:
    """From 8.1 degrees on it stayed where it was, and nothing said so."""
    ceiling = SENSORS.world["ceiling"]
    tilted = replace(ceiling, optical_from_world=world_from_downward_optical(rotation_deg).T)
    sensors, far = replace(SENSORS, world={"ceiling": tilted}), np.array([3.4, -2.4, 1.6, 0.0])
    assert is_lost("drone_1", belief(far, 0.1), CONTROL, sensors, unseen_s=10.0)
    goal = return_stand(far, view_of(3.4, -2.4, "drone_1", CONTROL.return_height_m, sensors))
    marker_m = CONTROL.return_height_m + sensors.marker_height_m["drone_1"]
    assert sensors.world_in_view("ceiling", np.array([goal.x, goal.y, marker_m]))


def test_an_odometry_that_is_known_to_be_wrong_leaves_less_time_out_of_sight() -> None:
    sound, wrong = (time_left_s(0.1, 3.0, CONTROL, error_m_s) for error_m_s in (0.06, 0.25))
    assert sound == time_left_s(0.1, 3.0, CONTROL), "any odometry is off by so much"
    assert wrong == pytest.approx((CONTROL.return_limit_m - 0.1) / 0.25)
    far = belief(np.array([2.6, 0.0, 1.6, 0.0]), 0.1)
    assert is_lost("drone_1", far, CONTROL, SENSORS, unseen_s=2.0, velocity_error_m_s=0.25)
    assert not is_lost("drone_1", far, CONTROL, SENSORS, unseen_s=2.0, velocity_error_m_s=0.06)
    assert not is_lost("drone_1", far, CONTROL, SENSORS, unseen_s=1.0, velocity_error_m_s=0.25)


def test_an_unseen_robot_expected_in_view_is_lost_after_velocity_errors() -> None:
    near = belief(np.array([0.3, 0.0, 1.6, 0.0]), 0.3)
    assert is_lost("drone_1", near, CONTROL, SENSORS, unseen_s=3.0, velocity_error_m_s=0.25)
    assert not is_lost("drone_1", near, CONTROL, SENSORS, unseen_s=3.0)
    assert not is_lost("drone_1", near, CONTROL, SENSORS, unseen_s=1.0, velocity_error_m_s=0.25)


def test_the_error_of_an_odometry_is_its_mean_and_its_deviation() -> None:
    labels = (*ROBOT_CORE, "velocity_bias_x", "velocity_bias_y")
    layout = StateLayout().with_entity("drone_1", EntityKind.ROBOT, labels)
    mean, deviations = np.array([0.0, 0.0, 1.6, 0.0, 0.3, 0.1]), np.array([0.1, 0.1, 0.1, 0.1, 0.4, 0.2])
    whole = JointBelief(mean, np.diag(deviations**2), layout, 0)
    assert velocity_error_m_s(whole, "drone_1") == pytest.approx(0.5)
    assert velocity_error_m_s(whole.core(), "drone_1") == 0.0


def test_excursions_of_a_drone_whose_odometry_is_wrong_end_sooner() -> None:
    excursions, here = Excursions(CONTROL, SENSORS), belief(np.array([0.0, 0.0, 1.6, 0.0]), 0.05)
    trusted_s = excursions.left_s("drone_1", here)
    excursions.velocity_errors_m_s = {"drone_1": 0.2}
    left_s = excursions.left_s("drone_1", here)
    assert left_s == pytest.approx((CONTROL.return_limit_m - 0.05) / 0.2)
    assert left_s < trusted_s


@pytest.mark.parametrize(("error_m_s", "back_s"), [(0.2, 0.8), (0.25, 0.34), (0.5, 0.0)])
def test_a_robot_stays_within_reach_of_a_return_into_view(error_m_s: float, back_s: float) -> None:
    """Known to 0.02 m it reaches 0.48 m after 0.46 m / error; of that time 1.5 s are for turning and being observed."""
    at = belief(np.array([1.2, 0.0, 1.6, 0.0]), 0.02)
    outwards = within_reach(np.array([0.5, 0.0]), "drone_1", at, CONTROL, SENSORS, error_m_s, np.zeros(2))
    inwards = within_reach(np.array([-0.4, 0.1]), "drone_1", at, CONTROL, SENSORS, error_m_s, np.zeros(2))
    drifting = within_reach(np.array([0.5, 0.0]), "drone_1", at, CONTROL, SENSORS, error_m_s, np.array([0.2, 0.0]))
    border_m = SENSORS.root_views(1.6 + SENSORS.marker_height_m["drone_1"])[0].x_m[1] - VIEW_INSET_M
    assert outwards == pytest.approx([border_m + back_s * CONTROL.return_speed_m_s - 1.2, 0.0])
    assert inwards == pytest.approx([-0.4, 0.1])
    assert drifting == pytest.approx(outwards - [0.2, 0.0])


@pytest.mark.parametrize(("error_m_s", "crosses"), [(0.2, True), (0.6, False)])
def test_a_view_that_it_reaches_in_time_may_be_crossed_to(error_m_s: float, crosses: bool) -> None:
    ceiling = SENSORS.world["ceiling"]
    two = {name: replace(ceiling, position_m=(x, 0.0, 4.2)) for name, x in (("west", -1.6), ("east", 1.6))}
    at = belief(np.array([-0.4, 0.0, 1.6, 0.0]), 0.02)  # 0.8 m between them
    found = within_reach(
        np.array([0.5, 0.0]), "drone_1", at, CONTROL, replace(SENSORS, world=two), error_m_s, np.zeros(2)
    )
    assert found[0] == pytest.approx(0.5) if crosses else found[0] < 0.0


def test_a_robot_too_uncertain_to_leave_is_held_to_the_view() -> None:
    """No time is left to fly on out of view."""
    at = belief(np.array([1.2, 0.0, 1.6, 0.0]), 0.6)
    border_m = SENSORS.root_views(1.6 + SENSORS.marker_height_m["drone_1"])[0].x_m[1] - VIEW_INSET_M
    held = within_reach(np.array([0.5, 0.0]), "drone_1", at, CONTROL, SENSORS, 0.4, np.zeros(2))
    assert held == pytest.approx([border_m - 1.2, 0.0])


def test_without_a_view_in_the_room_nobody_is_held_back() -> None:
    blind, at = replace(SENSORS, world={}), belief(np.array([1.12, 0.0, 1.6, 0.0]), 0.02)
    assert within_reach(np.array([0.5, 0.0]), "drone_1", at, CONTROL, blind, 0.4, np.zeros(2)) == pytest.approx(
        [0.5, 0.0]
    )


def test_places_from_which_it_could_not_be_back_in_time_are_not_gone_to() -> None:
    excursions = Excursions(CONTROL, SENSORS)
    places = np.array([(0.0, 0.0), (2.0, 0.0), (3.4, 2.4)])
    here = belief(np.array([0.0, 0.0, 1.6, 0.0]), 0.05)
    inside, near, far = excursions.allowed_s("drone_1", here, places)
    assert inside == math.inf
    assert near > far > 5.0
    excursions.unseen_s = {"drone_1": 11.0}
    inside, near, far = excursions.allowed_s("drone_1", here, places)
    assert inside == math.inf
    assert near < 2.0
    assert far < 0.0


@pytest.mark.parametrize("start", [(1.2, 0.0), (0.9, 0.9), (1.5, -1.0), (-1.8, 0.6), (0.0, 2.0)])
def test_a_drone_that_flies_outwards_unseen_is_back_in_view_before_it_is_lost(start: tuple[float, float]) -> None:
    """It flies away at 0.5 m/s until RETURN, and follows velocities with a lag."""
    pose, velocity = np.array([*start, 1.6, 0.0]), np.zeros(3)
    away = 0.5 * np.array([*start, 0.0]) / math.hypot(*start)
    velocity[:] = away
    unseen_s, seen = 0.0, False
    while not seen and unseen_s < 20.0:
        unseen_s += TICK_S
        sight, std_m = Sight(None, {"drone_1": unseen_s}), 0.05 + 0.03 * unseen_s
        out = setpoints_from_plan(None, belief(pose, std_m), ("drone_1",), CONTROL, SENSORS, sight)["drone_1"]
        wanted = np.array(out.velocity_m_s) if out.phase is FlightMode.RETURN else away
        velocity += TICK_S / LAG_S * (wanted - velocity)
        pose[:3] += TICK_S * velocity
        marker = SENSORS.marker("drone_1", pose, is_robot=True)
        seen = out.phase is FlightMode.RETURN and SENSORS.world_in_view("ceiling", marker)
    assert seen
    assert unseen_s < CONTROL.return_within_s + 0.5
    assert std_m < LAB.safety.max_position_std_m

"""Setpoints from plans: level heights, columns, the search, the return, and the flight-mode table."""

import math
from collections.abc import Collection, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from groundstation.bus.messages import SolverReport
from groundstation.control.flight_mode import FlightMode, Situation, flight_mode_of
from groundstation.control.moment import Sight
from groundstation.control.parameters import control_from_field
from groundstation.control.setpoints import Setpoint, setpoints_from_plan
from groundstation.control.stand import Stand
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.planning.planner import PlanResult
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.topology import Topology
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

LAB = resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml"))
SENSORS, CONTROL = sensors_from_field(LAB), control_from_field(LAB)
NAMES = ("drone_1", "drone_2")
STANDS = {"drone_1": Stand(1.5, 1.5, 1.0), "drone_2": Stand(-1.5, -0.5, -2.0)}


def searching(robots: Sequence[str], _targets: Collection[str]) -> dict[str, Stand]:
    return {name: STANDS[name] for name in robots}


def belief(
    first: tuple[float, ...],
    second: tuple[float, ...],
    target: tuple[float, ...] | None = (0.5, 0.0, 0.0, 0.0),
    robot_std: float = 0.03,
    target_std: float = 0.05,
    stamp_s: float = 0.0,
) -> JointBelief:
    layout = StateLayout()
    for name in NAMES:
        layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
    mean, variances = [*first, *second], [robot_std**2] * 8
    if target:
        layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
        mean, variances = [*mean, *target], [*variances, *[target_std**2] * 4]
    return JointBelief(np.array(mean), np.diag(variances), layout, round(stamp_s * 1e9))


def plan(heights: tuple[float, float], topology: str = "drone_1/drone_2") -> PlanResult:
    return PlanResult(
        topology=Topology.parse(topology),
        cost=0.1,
        uncertainty=0.1,
        controls={"drone_1": np.array([0.2, -0.1, 0.3]), "drone_2": np.array([0.0, 0.1, -0.2])},
        heights=dict(zip(NAMES, heights, strict=True)),
        edges=(),
        alternatives=(),
        solver=SolverReport("complete", 1, 0.0, 1, 1),
        mode="multistart",
        stamp_ns=0,
    )


def setpoints(
    at: JointBelief, plan: PlanResult | None, age: float | None = 0.1, airborne: tuple[str, ...] = NAMES
) -> dict[str, Setpoint]:
    return setpoints_from_plan(plan, at, airborne, CONTROL, SENSORS, Sight(age, search=searching))


def test_a_plan_is_flown_as_it_is_and_heights_are_held() -> None:
    out = setpoints(belief((0, 0.8, 2.0, 0), (0, -0.8, 1.25, 0)), plan((2.1, 1.2)))
    assert out["drone_1"].velocity_m_s[:2] == pytest.approx((0.2, -0.1))
    assert out["drone_1"].yaw_rate_rad_s == pytest.approx(0.3)
    assert out["drone_1"].velocity_m_s[2] > 0 > out["drone_2"].velocity_m_s[2]
    assert {s.phase for s in out.values()} == {FlightMode.TRACK}


def test_climbing_is_bounded_by_the_limit() -> None:
    out = setpoints(belief((0, 2, 0.5, 0), (0, -2, 1.2, 0)), plan((2.1, 1.2)))
    assert out["drone_1"].velocity_m_s[2] == pytest.approx(0.4)


def test_nobody_changes_height_within_anothers_column_but_steps_aside() -> None:
    out = setpoints(belief((0.3, 0.3, 2.1, 1.0), (0.3, -0.3, 1.2, 0)), plan((1.5, 1.5), "drone_1,drone_2"))
    for name, side in (("drone_1", 1.0), ("drone_2", -1.0)):
        one = out[name]
        assert one.velocity_m_s[2] == 0.0
        assert one.blocked in NAMES and one.blocked != name
        yaw = 1.0 if name == "drone_1" else 0.0
        vy = math.sin(yaw) * one.velocity_m_s[0] + math.cos(yaw) * one.velocity_m_s[1]
        assert side * vy >= CONTROL.side_step_m_s - 1e-9


def test_small_corrections_of_height_go_on_within_a_column() -> None:
    out = setpoints(belief((0.3, 0.3, 2.05, 0), (0.3, -0.3, 1.2, 0)), plan((2.1, 1.2)))
    assert out["drone_1"].velocity_m_s[2] == pytest.approx(0.05 * CONTROL.height_gain_per_s)
    assert out["drone_1"].blocked == ""


@pytest.mark.parametrize("age", [None, 5.0])
def test_without_a_fresh_target_they_go_to_the_stands_of_the_search(age: float | None) -> None:
    at = [np.array([-0.5, 0.5, 1.3, 0.0]), np.array([-0.5, -0.5, 1.3, 0.0])]
    for tick in range(400):
        out = setpoints(belief(tuple(at[0]), tuple(at[1]), stamp_s=0.05 * tick), plan((1.5, 1.5)), age)
        for pose, name in zip(at, NAMES, strict=True):
            assert out[name].phase is FlightMode.SEARCH
            vx, vy, vz = out[name].velocity_m_s
            c, s = math.cos(pose[3]), math.sin(pose[3])
            pose += 0.05 * np.array([c * vx - s * vy, s * vx + c * vy, vz, out[name].yaw_rate_rad_s])
    for pose, name in zip(at, NAMES, strict=True):
        stand = STANDS[name]
        assert pose == pytest.approx([stand.x, stand.y, CONTROL.search_height_m, stand.yaw], abs=0.05)


def test_a_robot_without_a_place_to_search_waits_in_view() -> None:
    at = belief((2.0, 0.5, 1.6, 0.0), (-0.5, -0.5, 1.6, 0.0))
    out = setpoints_from_plan(None, at, NAMES, CONTROL, SENSORS)
    assert out["drone_1"].phase is FlightMode.SEARCH
    assert out["drone_1"].velocity_m_s[0] < -0.2


def test_one_that_a_fixed_camera_misses_turns_and_looks_for_the_view() -> None:
    at = belief((0.1, 0.3, 1.6, 0.0), (-1.5, -0.5, 1.6, 0.0))
    turned = []
    for missed_s in (0.5, 3.0, 10.0):
        sight = Sight(0.1, {"drone_1": 4.0}, {"drone_1": missed_s})
        out = setpoints_from_plan(plan((1.6, 1.6)), at, NAMES, CONTROL, SENSORS, sight)["drone_1"]
        assert out.phase is FlightMode.RETURN
        turned.append((out.yaw_rate_rad_s, math.hypot(*out.velocity_m_s[:2])))
    assert all(rate > 0.5 for rate, _ in turned)
    assert turned[-1][1] > 0.2


def test_two_that_fly_back_are_given_a_stand_each() -> None:
    at = belief((2.5, 0.3, 1.6, 0.0), (2.5, -0.9, 1.6, 0.0), robot_std=0.4)
    places = [np.array([2.5, 0.3, 1.6, 0.0]), np.array([2.5, -0.9, 1.6, 0.0])]
    for _ in range(800):
        at = belief(tuple(places[0]), tuple(places[1]), robot_std=0.4)
        out = setpoints_from_plan(None, at, NAMES, CONTROL, SENSORS, Sight(5.0, dict.fromkeys(NAMES, 20.0)))
        assert {one.phase for one in out.values()} == {FlightMode.RETURN}
        for pose, name in zip(places, NAMES, strict=True):
            pose[:3] += 0.05 * np.array(out[name].velocity_m_s)
    assert all(SENSORS.world_in_view("ceiling", np.add(pose[:3], (0, 0, 0.08))) for pose in places)
    assert math.dist(places[0][:2], places[1][:2]) > CONTROL.column_m - 0.05


def test_a_lost_robot_flies_back_towards_the_middle_of_the_view() -> None:
    out = setpoints(belief((3.0, 1.0, 1.5, 0.0), (0.0, 0.0, 1.5, 0.0), robot_std=0.4), plan((1.5, 1.5)))
    assert out["drone_1"].phase is FlightMode.RETURN
    assert out["drone_1"].velocity_m_s[0] < 0 and out["drone_1"].velocity_m_s[1] < 0
    assert out["drone_2"].phase is FlightMode.TRACK  # as uncertain, but in view: the camera will see it


@pytest.mark.parametrize(("unseen_s", "gives_way"), [(20.0, True), (0.1, False)])
def test_a_tracking_robot_gives_way_to_an_uncertain_returning_one(unseen_s: float, gives_way: bool) -> None:
    yaw = 1.0
    at = belief((1.6, 0.3, 1.5, 0.0), (0.0, 0.0, 1.5, yaw), robot_std=0.3)
    out = setpoints_from_plan(plan((1.5, 1.5)), at, NAMES, CONTROL, SENSORS, Sight(0.1, {"drone_1": unseen_s}))
    assert out["drone_1"].phase is (FlightMode.RETURN if gives_way else FlightMode.TRACK)
    assert out["drone_2"].phase is FlightMode.TRACK
    vx, vy, _ = out["drone_2"].velocity_m_s
    away = -np.array([1.6, 0.3]) / math.hypot(1.6, 0.3)
    speed = away @ (math.cos(yaw) * vx - math.sin(yaw) * vy, math.sin(yaw) * vx + math.cos(yaw) * vy)
    lacking_m = CONTROL.column_m + 3.0 * 0.3 - math.hypot(1.6, 0.3)
    assert lacking_m > 0.2
    if gives_way:
        assert speed == pytest.approx(lacking_m)
    else:
        assert (vx, vy) == (0.0, 0.1)


def test_nobody_makes_room_for_one_that_lands() -> None:
    at = belief((1.6, 0.3, 1.5, 0.0), (0.0, 0.0, 1.5, 0.0), robot_std=0.3)
    sight = Sight(0.1, {"drone_1": 20.0}, unsteered=("drone_1",))
    out = setpoints_from_plan(plan((1.5, 1.5)), at, NAMES, CONTROL, SENSORS, sight)
    assert out["drone_1"].phase is FlightMode.RETURN
    assert out["drone_2"].velocity_m_s[:2] == pytest.approx((0.0, 0.1))


def test_robots_that_follow_no_setpoints_do_not_search_and_are_avoided() -> None:
    asked: list[list[str]] = []

    def search(robots: Sequence[str], _targets: Collection[str]) -> dict[str, Stand]:
        asked.append(list(robots))
        return {name: Stand(1.5, 1.3, 0.0) for name in robots}

    at = belief((1.5, 1.5, 1.5, 0.0), (0.0, 1.5, 1.5, 0.0), target=None)
    held = Sight(None, search=search, unsteered=("drone_1",))
    out = setpoints_from_plan(None, at, NAMES, CONTROL, SENSORS, held)
    free = setpoints_from_plan(None, at, NAMES, CONTROL, SENSORS, Sight(None, search=search, unsteered=NAMES))
    assert asked == [["drone_2"], list(NAMES)], "where nobody follows any yet, all may soon"
    assert out["drone_1"].velocity_m_s[:2] == pytest.approx((0.0, 0.0))
    assert out["drone_2"].velocity_m_s[0] < free["drone_2"].velocity_m_s[0]


def test_a_plan_does_not_take_out_of_the_view_whose_odometry_errs() -> None:
    at = belief((1.2, 0.0, 1.5, 0.0), (0.0, 0.0, 1.5, 0.0))
    wrong, sound = (
        setpoints_from_plan(
            plan((1.5, 1.5)), at, NAMES, CONTROL, SENSORS, Sight(0.1, velocity_errors_m_s={"drone_1": error})
        )
        for error in (0.35, 0.05)
    )
    assert sound["drone_1"].velocity_m_s[:2] == pytest.approx((0.2, -0.1))
    assert wrong["drone_1"].velocity_m_s[0] < -0.1
    assert wrong["drone_1"].yaw_rate_rad_s == sound["drone_1"].yaw_rate_rad_s


def test_the_way_back_is_flown_against_the_drift_that_was_measured() -> None:
    at = belief((3.0, 0.0, 1.5, 0.0), (0.0, 0.0, 1.5, 0.0), robot_std=0.4)

    def back(drift: tuple[float, float]) -> np.ndarray:
        sight = Sight(0.1, drifts_m_s={name: np.array([*drift, 0.0]) for name in NAMES})
        out = setpoints_from_plan(plan((1.5, 1.5)), at, NAMES, CONTROL, SENSORS, sight)
        assert (out["drone_1"].phase, out["drone_2"].phase) == (FlightMode.RETURN, FlightMode.TRACK)
        assert out["drone_2"].velocity_m_s[:2] == (0.0, 0.1), "who tracks flies as planned"
        return np.array(out["drone_1"].velocity_m_s[:2])

    still = back((0.0, 0.0))
    assert back((0.1, -0.2)) == pytest.approx(still - (0.1, -0.2))
    assert back((0.0, 3.0)) == pytest.approx(still - (0.0, CONTROL.return_drift_m_s)), "no more than is believable"


def test_an_airborne_drone_that_was_never_seen_hovers_and_a_grounded_one_gets_nothing() -> None:
    out = setpoints(belief((0, 1, 1.5, 0), (0, -1, 1.5, 0)), plan((1.5, 1.5)), airborne=("drone_1", "drone_9"))
    assert set(out) == {"drone_1", "drone_9"}
    assert out["drone_9"] == Setpoint((0.0, 0.0, 0.0), 0.0, FlightMode.UNKNOWN)


def test_without_a_plan_they_search() -> None:
    out = setpoints(belief((0, 1, 1.5, 0), (0, -1, 1.5, 0)), None)
    assert {one.phase for one in out.values()} == {FlightMode.SEARCH}


def test_the_flight_mode_table() -> None:
    for known, lost, fresh, planned in product((False, True), repeat=4):
        expected = FlightMode.RETURN if lost else FlightMode.TRACK if fresh and planned else FlightMode.SEARCH
        expected = expected if known else FlightMode.UNKNOWN
        assert flight_mode_of(Situation(known, lost, fresh, planned)) is expected


def test_while_one_target_is_tracked_the_robot_farthest_from_it_searches_for_a_missing_one() -> None:
    at = belief((-0.5, 0.5, 1.3, 0.0), (-1.5, -0.5, 1.3, 0.0))
    common, looked_for = plan((1.3, 1.3), "drone_1,drone_2"), Sight(0.1, missing=("other",))
    out = setpoints_from_plan(common, at, NAMES, CONTROL, SENSORS, Sight(0.1))
    assert {s.phase for s in out.values()} == {FlightMode.TRACK}
    out = setpoints_from_plan(common, at, NAMES, CONTROL, SENSORS, looked_for)
    assert (out["drone_1"].phase, out["drone_2"].phase) == (FlightMode.TRACK, FlightMode.SEARCH)
    alone = setpoints_from_plan(common, at, ("drone_1",), CONTROL, SENSORS, looked_for)
    assert alone["drone_1"].phase is FlightMode.TRACK

"""One planning step: its choice, the reasons, and its behaviour when time or belief run out."""

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.errors import EstimatorFault
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.planning.parameters import PlannerParameters, parameters_from_field
from groundstation.planning.planner import Planner, PlanRequest, PlanResult, choose
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.topology import Topology
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

LAB = resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml"))
SENSORS = sensors_from_field(LAB)
PARAMETERS = parameters_from_field(LAB)
FLAT, STRING = Topology.parse("drone_1,drone_2"), Topology.parse("drone_1/drone_2")


def belief(
    robots: Mapping[str, tuple[float, ...]],
    target: tuple[float, ...] | None,
    stamp_s: float = 0.0,
    target_std: float = 0.05,
    extra: tuple[str, ...] = (),
) -> JointBelief:
    layout, mean, variances = StateLayout(), [], []
    for name, pose in robots.items():
        layout = layout.with_entity(name, EntityKind.ROBOT, (*ROBOT_CORE, *extra))
        mean += [*pose, *(0.0 for _ in extra)]
        variances += [0.03**2, 0.03**2, 0.04**2, 0.03**2, *(0.1 for _ in extra)]
    if target is not None:
        layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
        mean += target
        variances += [target_std**2] * 2 + [0.1**2] * 2
    return JointBelief(np.array(mean), np.diag(variances), layout, round(stamp_s * 1e9))


NEAR = belief({"drone_1": (-0.9, 0.55, 1.5, -0.4), "drone_2": (-0.9, -0.55, 1.5, 0.4)}, (0.0, 0.0, 0.1, 0.0))
FAR = belief({"drone_1": (0.7, 0.3, 2.1, -0.2), "drone_2": (1.9, -0.2, 1.2, 0.2)}, (2.8, 0.0, 0.1, 0.0))


def plan(
    at: JointBelief, current: Topology, parameters: PlannerParameters = PARAMETERS, sensors: SensorSuite = SENSORS
) -> PlanResult:
    return Planner(parameters, sensors).plan(at, current, None, lambda: False)


def test_the_robot_nearer_to_a_far_target_takes_the_lower_level() -> None:
    eager = replace(PARAMETERS, min_dwell_s=0.0)
    turned = belief({"drone_1": (1.9, -0.2, 1.2, 0.2), "drone_2": (0.7, 0.3, 2.1, -0.2)}, (2.8, 0.0, 0.1, 0.0))
    for at, below, expected in ((FAR, "drone_2", STRING), (turned, "drone_1", Topology.parse("drone_2/drone_1"))):
        assert plan(at, FLAT, eager).topology == expected, below
        assert plan(at, expected, eager).topology == expected


def test_heights_are_chosen_between_the_lowest_and_the_highest() -> None:
    """A tilt causes an error that grows with the height above the target: near it, both go down as far as they may."""
    low, high = PARAMETERS.heights_m
    near, far = plan(NEAR, FLAT), plan(FAR, STRING)
    assert all(low <= height <= high for result in (near, far) for height in result.heights.values())
    assert max(near.heights.values()) < low + 0.15


class OfAnotherPackage:
    """Plans without the argument `held`, and does not accept it."""

    def plan(self, at: JointBelief, current: Topology, *_: Any) -> PlanResult:
        return plan(at, current)


def test_a_planner_of_another_package_need_not_ask_who_is_held() -> None:
    request = PlanRequest(NEAR, FLAT, {}, frozenset({"drone_2"}))
    told = request.put_to(Planner(PARAMETERS, SENSORS), lambda: False)
    untold = request.put_to(OfAnotherPackage(), lambda: False)
    assert told.cost > untold.cost == plan(NEAR, FLAT).cost


class Unaware(Planner):
    """Overrides `plan` without the argument `held`."""

    def plan(self, at: JointBelief, current: Topology, *_: Any) -> PlanResult:
        return plan(at, current)


class Aware(Planner):
    """Shows the robots passed as held."""

    def plan(self, *_: Any, held: frozenset[str] = frozenset()) -> PlanResult:
        raise ValueError(held)


def test_a_subclass_is_told_who_is_held_if_its_plan_asks() -> None:
    request = PlanRequest(NEAR, FLAT, {}, frozenset({"drone_2"}))
    assert request.put_to(Unaware(PARAMETERS, SENSORS), lambda: False).cost == plan(NEAR, FLAT).cost
    with pytest.raises(ValueError, match="drone_2"):
        request.put_to(Aware(PARAMETERS, SENSORS), lambda: False)


def test_one_that_follows_no_plan_stays_where_it_is_and_still_looks() -> None:
    free = plan(FAR, STRING)
    held = Planner(PARAMETERS, SENSORS).plan(FAR, STRING, None, lambda: False, held=frozenset({"drone_2"}))
    limits = PARAMETERS.limits_of("drone_2")
    assert np.linalg.norm(free.controls["drone_2"][:2]) > 0.1
    assert np.linalg.norm(held.controls["drone_2"][:2]) < 0.02 * limits.max_speed_m_s
    assert abs(held.controls["drone_2"][2]) < 0.02 * limits.max_yaw_rate_rad_s
    assert held.heights["drone_2"] == pytest.approx(1.2, abs=0.05)
    assert np.linalg.norm(held.controls["drone_1"][:2]) > 0.02
    assert held.cost > free.cost


def test_the_last_plan_is_gone_on_with_heights_included() -> None:
    first = plan(NEAR, FLAT)
    starts = (first.warm_start, None)
    again, cold = (Planner(PARAMETERS, SENSORS).plan(NEAR, FLAT, warm, lambda: False, 1) for warm in starts)
    assert again.cost == pytest.approx(first.cost, rel=1e-3)
    assert again.cost < cold.cost


def test_a_plan_names_controls_slots_edges_and_alternatives() -> None:
    result = plan(NEAR, FLAT, replace(PARAMETERS, hysteresis=1.0))
    assert set(result.controls) == {"drone_1", "drone_2"}
    assert set(result.heights) == {"drone_1", "drone_2"}
    assert {(e.observer, e.subject) for e in result.edges} == {
        ("ceiling", "drone_1"), ("ceiling", "drone_2"), ("drone_1", "turtlebot"), ("drone_2", "turtlebot")
    }  # fmt: skip
    assert {a.topology for a in result.alternatives} == {"drone_1/drone_2", "drone_2/drone_1"}
    assert 0 < result.uncertainty <= result.cost
    assert (result.solver.status, result.solver.topologies) == ("complete", 3)
    assert result.solver.evaluations > 10


def test_controls_respect_the_limits_at_every_corner() -> None:
    for at in (NEAR, FAR, belief({"drone_1": (0, 0, 1.5, 3.0)}, (3.0, 0.0, 0.5, 0.5))):
        controls = plan(at, Topology.flat(at.layout.robots)).controls
        assert set(controls) == set(at.layout.robots)
        for vx, vy, rate in controls.values():
            assert math.hypot(vx, vy) <= 0.6 + 1e-9
            assert abs(rate) <= math.radians(60) + 1e-9


def test_a_new_topology_must_gain_more_than_the_hysteresis() -> None:
    costs = {FLAT: 1.0, STRING: 0.96}
    assert choose(FLAT, costs, 0.05) == FLAT
    assert choose(FLAT, costs, 0.0) == STRING
    assert choose(FLAT, {FLAT: 1.0, STRING: 0.94}, 0.05) == STRING
    assert choose(FLAT, {STRING: 9.0}, 0.05) == STRING


def test_after_a_switch_it_dwells_unless_much_is_gained() -> None:
    parameters = replace(PARAMETERS, min_dwell_s=2.0, urgent_gain=0.99)
    planner = Planner(parameters, SENSORS)
    chosen = [
        planner.plan(replace(FAR, stamp_ns=round(t * 1e9)), FLAT, None, lambda: False).topology
        for t in (10.0, 11.0, 11.9, 12.1)
    ]
    assert chosen == [FLAT, FLAT, FLAT, STRING]


def _exceeds(asked: Iterator[int], allowed: int) -> bool:
    return next(asked) > allowed


def test_a_stopped_plan_is_valid_and_repeats_from_its_evaluation_count() -> None:
    for allowed in (0, 1, 2, 3):
        asked = itertools.count(1)
        stopped = Planner(PARAMETERS, SENSORS).plan(NEAR, FLAT, None, partial(_exceeds, asked, allowed))
        assert stopped.solver.status == "stopped"
        again = Planner(PARAMETERS, SENSORS).plan(NEAR, FLAT, None, lambda: False, stopped.solver.evaluations)
        assert again.cost == stopped.cost
        assert all((again.controls[name] == stopped.controls[name]).all() for name in stopped.controls)


def test_a_complete_plan_repeats_to_the_bit() -> None:
    first = plan(NEAR, FLAT)
    again = Planner(PARAMETERS, SENSORS).plan(NEAR, FLAT, None, lambda: False, first.solver.evaluations)
    assert again.cost == first.cost and again.topology == first.topology


def test_without_robots_or_targets_it_idles() -> None:
    for at in (belief({}, (0.0, 0.0, 0.0, 0.0)), belief({"drone_1": (0, 0, 1.5, 0)}, None)):
        result = plan(at, Topology.flat(at.layout.robots))
        assert result.solver.status == "idle"
        assert result.controls == {}


def test_robots_that_are_not_in_the_belief_are_left_out() -> None:
    at = belief({"drone_2": (-0.9, 0.0, 1.5, 0.0)}, (0.0, 0.0, 0.0, 0.0))
    result = plan(at, STRING)
    assert str(result.topology) == "drone_2"
    assert set(result.heights) == {"drone_2"}


def test_calibration_entries_do_not_change_the_plan() -> None:
    poses = {"drone_1": (-0.9, 0.55, 1.5, -0.4), "drone_2": (-0.9, -0.55, 1.5, 0.4)}
    more = belief(poses, (0.0, 0.0, 0.1, 0.0), extra=("climb", "velocity_scale"))
    assert plan(more, FLAT).cost == plan(NEAR, FLAT).cost


def test_an_indefinite_covariance_is_refused() -> None:
    broken = NEAR.covariance.copy()
    broken[0, 0] = -1.0
    with pytest.raises(EstimatorFault, match="semidefinite"):
        plan(replace(NEAR, covariance=broken), FLAT)


@pytest.mark.parametrize(
    "at",
    [
        belief({"drone_1": (0, 0, 1.5, 0), "drone_2": (0, 0, 1.5, 0)}, (0.0, 0.0, 0.0, 0.0)),
        belief({"drone_1": (9, 9, 1.5, 0), "drone_2": (-9, 9, 1.5, 0)}, (50.0, -50.0, 1.0, 1.0)),
        belief({"drone_1": (0, 0, 1.5, 0), "drone_2": (1, 0, 1.5, 0)}, (0.5, 0.0, 0.0, 0.0), target_std=1000.0),
        belief({"drone_1": (0, 0, 1.5, 0), "drone_2": (1, 0, 1.5, 0)}, (0.5, 0.0, 0.0, 0.0), target_std=0.0),
    ],
    ids=["at one point", "out of range", "huge prior", "zero prior"],
)
def test_extreme_beliefs_have_finite_plans(at: JointBelief) -> None:
    result = plan(at, FLAT)
    assert math.isfinite(result.cost)
    assert all(np.isfinite(u).all() for u in result.controls.values())


def test_levels_without_slots_are_not_considered() -> None:
    flat_only = replace(PARAMETERS, level_heights_m=((1.5,),))
    result = plan(NEAR, STRING, flat_only)
    assert result.topology == FLAT and result.alternatives == ()


def test_paper_mode_has_no_hysteresis_and_no_warm_start() -> None:
    paper = replace(PARAMETERS, mode="paper")
    costs = plan(NEAR, STRING, paper)
    assert costs.cost <= min(a.cost for a in costs.alternatives)
    warm = {"drone_1": np.ones(3), "drone_2": np.ones(3)}
    assert Planner(paper, SENSORS).plan(NEAR, STRING, warm, lambda: False).cost == costs.cost


def test_an_observer_settles_about_as_far_behind_as_above() -> None:
    """One robot under the ceiling camera, a target at rest: fly the plan until it rests."""
    pose, planner, warm = np.array([-1.2, 0.3, 1.5, 0.0]), Planner(PARAMETERS, SENSORS), None
    for tick in range(150):
        at = belief({"drone_1": tuple(pose)}, (0.2, 0.0, 0.0, 0.0), stamp_s=0.1 * tick)
        warm = planner.plan(at, Topology.flat(["drone_1"]), warm, lambda: False).controls
        vx, vy, rate = warm["drone_1"]
        c, s = math.cos(pose[3]), math.sin(pose[3])
        pose += 0.1 * np.array([c * vx - s * vy, s * vx + c * vy, 0.0, rate])
    behind, above = math.hypot(pose[0] - 0.2, pose[1]), pose[2] - 0.4
    assert 0.5 < behind / above < 1.4
    facing = math.atan2(-pose[1], 0.2 - pose[0])
    assert abs(math.remainder(facing - pose[3], math.tau)) < 0.3


def test_three_robots_have_plans_with_three_levels() -> None:
    sensors = replace(
        SENSORS,
        onboard=dict(SENSORS.onboard) | {"drone_3": SENSORS.onboard["drone_1"]},
        marker_height_m=dict(SENSORS.marker_height_m) | {"drone_3": 0.08},
    )
    poses = {"drone_1": (-0.9, 0.6, 1.9, 0.0), "drone_2": (-0.9, -0.6, 1.9, 0.0), "drone_3": (0.3, 0.0, 1.3, 0.0)}
    at = belief(poses, (1.2, 0.0, 0.0, 0.0))
    result = plan(at, Topology.parse("drone_1,drone_2/drone_3"), PARAMETERS, sensors)
    assert result.solver.topologies == 1 + len(Topology.parse("drone_1,drone_2/drone_3").neighbours())
    assert set(result.heights) == set(poses)

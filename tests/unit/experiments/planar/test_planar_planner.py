"""One decision of the planar planner: modes, proofs, budgets, and absurd input."""

import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.bench.planner_peers import naive, numpy_adjoint
from groundstation.experiments.planar.parameters import FIGURE_1, PlanarParameters
from groundstation.experiments.planar.planner import Fate, PlanarPlan, PlanarPlanner, SearchMode, SearchOptions
from groundstation.experiments.planar.scenarios import bench_belief

P = PlanarParameters()


def plan_of(robots: int, layout: str = "two-level", seed: int = 3, **options: Any) -> PlanarPlan:
    mean, covariance, level = bench_belief(robots, layout, seed, P)
    return PlanarPlanner(robots, P, SearchOptions(**options)).plan(mean, covariance, level)


def test_paper_mode_solves_current_and_neighbours_and_takes_the_cheapest() -> None:
    plan = plan_of(5, mode=SearchMode.PAPER, hysteresis=0.5)
    assert all(candidate.fate is Fate.SOLVED for candidate in plan.certificate)
    assert plan.cost == min(candidate.cost for candidate in plan.certificate if candidate.cost is not None)
    assert len(plan.certificate) == 11


def test_peers_agree() -> None:
    mean, covariance, level = bench_belief(4, "two-level", 3, P)
    plan = PlanarPlanner(4, P, SearchOptions(mode=SearchMode.PAPER)).plan(mean, covariance, level)
    for peer in (numpy_adjoint, naive):
        step = peer.solve(mean, covariance, tuple(int(k) for k in level), P)
        assert step.level == tuple(plan.level)
        assert step.cost == pytest.approx(plan.cost, rel=1e-3)
        assert step.topologies == len(plan.certificate)


def test_certified_mode_drops_with_proof() -> None:
    plan = plan_of(12)
    brute = plan_of(12, prune=False)
    assert plan.cost == brute.cost
    assert plan.complete and brute.complete
    dropped = [c for c in plan.certificate if c.fate in (Fate.TANGENT_BOUND, Fate.REACH_BOUND)]
    assert len(dropped) > 10
    assert all(c.cost is None and c.bound >= plan.cost for c in dropped)


def test_certified_mode_dissolves_a_string_at_once() -> None:
    mean, covariance, level = bench_belief(8, "string", 1, FIGURE_1)
    mean[:, 0], mean[:, 1] = np.linspace(0.1, 0.8, 9), 0.0
    plan = PlanarPlanner(8, FIGURE_1).plan(mean, covariance, level)
    assert plan.level.max() + 1 <= 3
    assert plan.switched


def test_global_mode_is_never_worse() -> None:
    for robots in (3, 4, 5):
        everything = plan_of(robots, "random", mode=SearchMode.GLOBAL)
        assert everything.cost <= plan_of(robots, "random").cost * (1.0 + 1e-12)
        assert len(everything.certificate) == {3: 13, 4: 75, 5: 541}[robots]
    with pytest.raises(ValueError, match="at most 6 robots"):
        plan_of(7, mode=SearchMode.GLOBAL)


def test_fixed_mode_keeps_the_topology() -> None:
    plan = plan_of(6, mode=SearchMode.FIXED)
    assert not plan.switched and len(plan.certificate) == 1


def test_hysteresis_keeps_the_topology_for_small_gains() -> None:
    free = plan_of(30)
    gain = 1.0 - free.cost / free.certificate[0].cost  # type: ignore[operator]
    assert 0.0 < gain < 0.2
    held = plan_of(30, hysteresis=gain + 1e-6)
    assert not held.switched and held.complete
    assert held.evaluations <= free.evaluations
    moved = plan_of(30, hysteresis=gain - 1e-6)
    assert moved.switched and moved.cost == free.cost


def test_hysteresis_gives_the_answer_of_brute_force() -> None:
    for seed in range(8):
        for hysteresis in (0.005, 0.02, 0.1):
            ours = plan_of(10, "random", seed, hysteresis=hysteresis)
            brute = plan_of(10, "random", seed, hysteresis=hysteresis, prune=False)
            assert ours.cost == brute.cost and (ours.level == brute.level).all()


def test_budget_gives_the_best_so_far() -> None:
    complete, costs = plan_of(20, "random"), []
    for budget in (1, 5, 20, 40, complete.evaluations + 1):
        plan = plan_of(20, "random", budget=budget)
        assert plan.evaluations <= budget + 2
        assert np.abs(plan.velocity_m_s).max() <= P.max_speed_m_s
        costs.append(plan.cost)
        assert plan.complete == (budget > complete.evaluations)
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == complete.cost


def test_stop_flag_ends_the_search() -> None:
    mean, covariance, level = bench_belief(20, "random", 3, P)
    planner = PlanarPlanner(20, P, SearchOptions(prune=False))
    planner.stop[0] = 1
    plan = planner.plan(mean, covariance, level)
    assert plan.evaluations == 1 and not plan.complete and not plan.switched
    planner.stop[0] = 0
    assert planner.plan(mean, covariance, level).complete


def test_another_thread_can_stop_it() -> None:
    mean, covariance, level = bench_belief(100, "two-level", 3, P)
    planner = PlanarPlanner(100, P, SearchOptions(prune=False, tolerance=1e-12))
    timer = threading.Timer(0.05, lambda: planner.stop.fill(1))
    timer.start()
    plan = planner.plan(mean, covariance, level)
    timer.join()
    assert not plan.complete
    assert plan.cost <= plan.certificate[0].cost  # type: ignore[operator]


def test_segments_and_starts_only_help() -> None:
    mean, covariance, level = bench_belief(6, "two-level", 5, P)
    one = PlanarPlanner(6, P, SearchOptions(mode=SearchMode.FIXED, tolerance=1e-6)).plan(mean, covariance, level)
    pieces = PlanarPlanner(6, P, SearchOptions(mode=SearchMode.FIXED, segments=5, tolerance=1e-6))
    plan = pieces.plan(mean, covariance, level)
    assert plan.velocity_m_s.shape == (5, 6, 2)
    assert plan.cost <= one.cost * (1.0 + 1e-6)
    options = SearchOptions(mode=SearchMode.FIXED, tolerance=1e-6, starts=4)
    again = [PlanarPlanner(6, P, options).plan(mean, covariance, level) for _ in range(2)]
    assert again[0].cost == again[1].cost <= one.cost
    assert again[0].evaluations > one.evaluations


def test_warm_start_saves_evaluations() -> None:
    mean, covariance, level = bench_belief(10, "two-level", 3, P)
    planner = PlanarPlanner(10, P, SearchOptions(mode=SearchMode.FIXED))
    assert planner.plan(mean, covariance, level).evaluations > planner.plan(mean, covariance, level).evaluations


def test_target_velocity_is_the_callers() -> None:
    mean, covariance, level = bench_belief(4, "two-level", 3, P)
    moving = replace(P, target_velocity_m_s=(0.2, 0.1))
    expected = PlanarPlanner(4, moving).plan(mean, covariance, level)
    assert PlanarPlanner(4, P).plan(mean, covariance, level, np.array([0.2, 0.1])).cost == expected.cost


def test_tail_pulls_towards_a_lost_target() -> None:
    mean = np.array([[0.2, 0.0], [0.4, 0.0], [2.5, 0.0]])
    covariance, level = np.diag([1e-3, 1e-3, 0.5]), np.array([0, 1])
    lost = PlanarPlanner(2, FIGURE_1).plan(mean, covariance, level)
    assert np.abs(lost.velocity_m_s).max() < 1e-9
    drawn = PlanarPlanner(2, replace(FIGURE_1, tail=1e-3)).plan(mean, covariance, level)
    assert drawn.velocity_m_s[0, :, 0].max() > 0.1


@pytest.mark.parametrize("robots", [1, 2, 5, 30])
@pytest.mark.parametrize("kind", ["one point", "tiny", "huge", "mixed", "out of range", "far apart"])
def test_odd_but_legal_input(robots: int, kind: str) -> None:
    mean, covariance, level = bench_belief(robots, "two-level", 1, P)
    match kind:
        case "one point":
            mean = np.zeros_like(mean)
        case "tiny":
            covariance = 1e-9 * np.eye(robots + 1)
        case "huge":
            covariance = 1e6 * np.eye(robots + 1)
        case "mixed":
            covariance = np.diag(np.logspace(-9, 6, robots + 1))
        case "out of range":
            mean = mean + 50.0
        case "far apart":
            mean = mean * 1e6
    for mode in (SearchMode.PAPER, SearchMode.CERTIFIED):
        plan = PlanarPlanner(robots, P, SearchOptions(mode=mode)).plan(mean, covariance, level)
        assert np.isfinite(plan.cost) and plan.cost > 0.0
        assert np.isfinite(plan.velocity_m_s).all() and np.abs(plan.velocity_m_s).max() <= P.max_speed_m_s
        assert plan.complete


def test_three_hundred_robots() -> None:
    plan = plan_of(300, "random", wide=False)
    assert plan.complete and np.isfinite(plan.cost)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda m, c: (m, c - 0.5 * np.eye(4)), "not positive semidefinite"),
        (lambda m, c: (m, c + np.triu(np.ones((4, 4)), 1)), "not symmetric"),
        (lambda m, c: (m, np.where(np.eye(4) > 0, np.nan, c)), "finite"),
        (lambda m, c: (m * np.inf, c), "finite"),
        (lambda m, c: (m[:3], c), "need mean"),
        (lambda m, c: (m[:3], c[:3, :3]), "made for 3 robots"),
        (lambda m, c: (m, np.ones((4, 4)) - 2.0 * np.eye(4)), "not positive semidefinite"),
    ],
)
def test_bad_beliefs_are_named(change: Any, message: str) -> None:
    mean, covariance, level = bench_belief(3, "two-level", 1, P)
    with pytest.raises(ValueError, match=message):
        changed_mean, changed_covariance = change(mean, covariance)
        PlanarPlanner(3, P).plan(changed_mean, changed_covariance, level)


def test_bad_levels_and_settings_are_named() -> None:
    mean, covariance, _ = bench_belief(3, "two-level", 1, P)
    for level in ([0, 2, 2], [1, 1, 1], [-1, 0, 1], [0, 1]):
        with pytest.raises(ValueError, match="without gaps"):
            PlanarPlanner(3, P).plan(mean, covariance, np.array(level))
    with pytest.raises(ValueError, match="at least one robot"):
        PlanarPlanner(0, P)
    for name in ("sigma_m", "softness_m", "step_s", "max_speed_m_s"):
        negative: dict[str, Any] = {name: -1.0}
        with pytest.raises(ValueError, match=name):
            replace(P, **negative)
    with pytest.raises(ValueError, match="hysteresis"):
        SearchOptions(hysteresis=1.0)
    with pytest.raises(ValueError, match="segments"):
        PlanarPlanner(3, P, SearchOptions(segments=6)).plan(mean, covariance, np.array([0, 0, 1]))


def test_semidefinite_covariance_is_accepted() -> None:
    mean, _, level = bench_belief(3, "two-level", 1, P)
    plan = PlanarPlanner(3, P).plan(mean, np.zeros((4, 4)), level)
    assert plan.cost > 0.0

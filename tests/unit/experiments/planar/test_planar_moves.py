"""Predicted cost of a topology with one robot moved, compared with its true cost, and the search that uses it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.experiments.planar.moved import evaluate, look, moved_cost, moved_robot, optimum_of
from groundstation.experiments.planar.objective import cost
from groundstation.experiments.planar.parameters import PlanarParameters
from groundstation.experiments.planar.planner import Fate, PlanarPlanner, SearchOptions
from groundstation.experiments.planar.problem import load_topology, make_problem, make_workspace, reorder
from groundstation.experiments.planar.scenarios import bench_belief, scattered_belief

PARAMETERS = PlanarParameters()


def moves(belief: Any, parameters: PlanarParameters = PARAMETERS, segments: int = 1) -> list[Any]:
    """Return predicted and true values of each move: cost, then the gradients' largest difference and entry."""
    mean, covariance, level = belief
    robots = len(level)
    problem, work = make_problem(mean, covariance, parameters, segments), make_workspace(robots, parameters.steps)
    controls = np.random.default_rng(0).uniform(-0.5, 0.5, 2 * robots * segments)
    at = optimum_of(level, controls, parameters.steps)
    look(at, problem, work)

    def true_cost(topology: Any) -> float:
        x = np.empty_like(controls)
        load_topology(topology, problem, work)
        reorder(controls, robots, work, x, True)
        return cost(x, problem, work)

    own, said, true, found = true_cost(level), np.empty_like(controls), np.empty_like(controls), []
    for robot in range(robots):
        for to in (level[robot] - 1, level[robot] + 1):
            moved = level.copy()
            moved[robot] = to
            if not (0 <= to <= level.max() and len(set(moved)) == len(set(level))):
                continue
            assert moved_robot(level, moved) == robot
            value, _ = moved_cost(moved, at, own, problem, said)
            evaluate(moved, controls, problem, work, true)
            found.append((value, true_cost(moved), np.abs(said - true).max(), np.abs(true).max()))
    return found


@pytest.mark.parametrize("segments", [1, 3])
@pytest.mark.parametrize("tail", [0.0, 1e-3])
def test_a_move_in_a_large_team(segments: int, tail: float) -> None:
    found = moves(bench_belief(80, "two-level", 3, PARAMETERS), replace(PARAMETERS, tail=tail), segments)
    assert len(found) == 80
    for said, true, difference, largest in found:
        assert true * (1.0 - 1e-3) < said <= true * (1.0 + 1e-12)
        assert difference < 0.1 * largest


@pytest.mark.parametrize("seed", range(20))
def test_no_move_costs_less_than_is_said(seed: int) -> None:
    belief = scattered_belief(2 + seed % 11, np.random.default_rng(seed), PARAMETERS)
    for said, true, _, _ in moves(belief):
        assert said <= true * (1.0 + 1e-9)


def test_other_changes_are_no_moves() -> None:
    two = np.array([0, 0, 1, 1])
    assert moved_robot(two, np.array([1, 0, 1, 0])) == -1  # two robots
    assert moved_robot(two, np.array([0, 0, 1, 2])) == -1  # the target's edges differ as well
    assert moved_robot(two, np.array([1, 1, 2, 0])) == -1


def test_resting_topologies_are_found_without_a_rollout() -> None:
    mean, covariance, level = bench_belief(160, "two-level", 3, PARAMETERS)
    options = SearchOptions(wide=False, tolerance=1e-3)
    ours = PlanarPlanner(160, PARAMETERS, options).plan(mean, covariance, level)
    brute = PlanarPlanner(160, PARAMETERS, replace(options, prune=False)).plan(mean, covariance, level)
    assert ours.cost == brute.cost
    solved = [k for k, row in enumerate(ours.certificate) if row.fate is Fate.SOLVED]
    assert ours.evaluations < 0.5 * len(solved)
    for k in solved:
        assert ours.certificate[k].cost == pytest.approx(brute.certificate[k].cost, rel=1e-4)

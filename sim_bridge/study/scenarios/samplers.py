"""Planners that sample controls instead of following a gradient: the comparison of later work on the method."""

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import SolverReport
from groundstation.estimation.belief import JointBelief
from groundstation.planning.planner import Planner, PlanResult
from groundstation.planning.problem import PlanningProblem, scene_from_belief
from groundstation.planning.records import HEIGHT, ROBOT_CONTROLS
from groundstation.planning.starts import Starts
from groundstation.sensing.topology import Topology
from sim_bridge.study.scenarios.fixed_topologies import EveryPair, FixedPlanner

SAMPLES = 400
"""Controls that the sampler tries in a step, some more than the evaluations of our search for two robots."""

_ROUNDS = 2
_WAYS = [(0.0, 0.0), *((math.cos(a), math.sin(a)) for a in np.arange(8) * math.pi / 4)]
PRIMITIVES = np.array([(*way, turn, height) for way in _WAYS for turn in (-1, 0, 1) for height in (-1, 0, 1)])
"""The lattice of one robot (81, 4): nine ways at full speed or none, three turns, three heights; 1 is the limit."""


class TryingPlanner(FixedPlanner):
    """Takes the best of the controls that it tries, by our planner's cost over all pairs, without a topology."""

    def __init__(self, planner: Planner) -> None:
        super().__init__(planner, "string", EveryPair)

    def plan(
        self,
        belief: JointBelief,
        current: Topology,
        warm_start: Mapping[str, Array] | None,
        should_stop: Callable[[], bool],
        max_evaluations: int | None = None,
        held: frozenset[str] = frozenset(),
    ) -> PlanResult:
        """Return the best of the tried controls; the last plan's are tried first."""
        topology = self.fixed(sorted(current.robots & frozenset(belief.layout.robots)))
        scene = scene_from_belief(belief, topology.robots, held)
        if not scene.robots or not scene.targets:
            return super().plan(belief, current, warm_start, should_stop, max_evaluations, held)
        problem = self._builder.build(scene, topology)
        starts = Starts(scene, self.parameters, self.sensors, problem.scale, self._builder.height_m)
        first = self._warm(scene, warm_start, np.zeros(problem.scale.size), starts, problem.scale)
        tried, x, cost = self.best(problem, first)
        u = x * problem.scale
        return PlanResult(
            topology, cost, cost,
            {name: u[ROBOT_CONTROLS * i : ROBOT_CONTROLS * i + HEIGHT] for i, name in enumerate(scene.robots)},
            dict(zip(scene.robots, self._builder.heights(u), strict=True)),
            (), (), SolverReport("complete", tried, 0.0, 1, 1), self.parameters.mode, belief.stamp_ns,
        )  # fmt: skip

    def best(self, problem: PlanningProblem, first: Array) -> tuple[int, Array, float]:
        """Return how many controls were tried, and the best in [-1, 1]^(4 n) with its cost."""
        raise NotImplementedError


class SamplingPlanner(TryingPlanner):
    """Random sampling: controls of all robots at once, drawn evenly."""

    def __init__(self, planner: Planner) -> None:
        super().__init__(planner)
        self._rng = np.random.default_rng(1)

    def best(self, problem: PlanningProblem, first: Array) -> tuple[int, Array, float]:
        """Return the best of the first and `SAMPLES` random ones."""
        tried = [first, np.zeros(first.size), *self._rng.uniform(-1.0, 1.0, (SAMPLES, first.size))]
        costs = [problem.value(x) for x in tried]
        least = int(np.argmin(costs))
        return len(tried), tried[least], costs[least]


class LatticePlanner(TryingPlanner):
    """A lattice of motion primitives: one robot after the other takes its best while the others keep theirs."""

    def best(self, problem: PlanningProblem, first: Array) -> tuple[int, Array, float]:
        """Return the best after two rounds over the robots."""
        robots = first.size // ROBOT_CONTROLS
        x, cost = first, problem.value(first)
        tried = 1
        for robot in list(range(robots)) * _ROUNDS:
            for other in _with(x, robot):
                value = problem.value(other)
                tried += 1
                if value < cost:
                    x, cost = other, value
        return tried, x, cost


def _with(x: Array, robot: int) -> Iterator[Array]:
    """Yield the controls with each primitive in place of a robot's."""
    for primitive in PRIMITIVES:
        other = x.copy()
        other[ROBOT_CONTROLS * robot : ROBOT_CONTROLS * (robot + 1)] = primitive
        yield other

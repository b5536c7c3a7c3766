"""One planning step: optimise the current topology and its neighbours, choose one, say why."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import Alternative, Edge, SolverReport
from groundstation.errors import EstimatorFault
from groundstation.estimation.belief import JointBelief
from groundstation.planning.parameters import PlannerParameters
from groundstation.planning.problem import PlanningProblem, PlanningScene, ProblemBuilder, Solution, scene_from_belief
from groundstation.planning.starts import starts
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.topology import Topology


@dataclass(frozen=True, slots=True)
class PlanResult:
    """The chosen topology with held controls.

    cost [m^2]: with penalties; uncertainty [m^2]: the discounted trace alone. controls: (vx, vy, yaw rate) per robot
    [m/s, m/s, rad/s; base_stabilized]; heights: slot of each robot [m]. solver.status: complete | stopped (out of
    time or evaluations: the best so far) | idle (no robot or no target). solver.seconds is left 0: the core has no
    clock.
    """

    topology: Topology
    cost: float
    uncertainty: float
    controls: Mapping[str, Array]
    heights: Mapping[str, float]
    edges: tuple[Edge, ...]
    alternatives: tuple[Alternative, ...]
    solver: SolverReport
    mode: str
    stamp_ns: int


@dataclass(slots=True)
class _Search:
    """State of one planning step: solutions so far, evaluations spent, and whether to stop."""

    should_stop: Callable[[], bool]
    max_evaluations: int | None
    evaluations: int = 0
    stopped: bool = False
    solutions: dict[Topology, Solution] = field(default_factory=dict)

    def must_stop(self) -> bool:
        spent = self.max_evaluations is not None and self.evaluations >= self.max_evaluations
        self.stopped = self.stopped or spent or self.should_stop()
        return self.stopped

    def add(self, solution: Solution) -> None:
        self.evaluations += solution.evaluations
        known = self.solutions.get(solution.topology)
        if known is None or solution.cost < known.cost:
            self.solutions[solution.topology] = solution


def choose(current: Topology, costs: Mapping[Topology, float], required_gain: float) -> Topology:
    """Return the cheapest topology if it beats the current one by the required relative gain, else the current one.

    Ties go to the first in the order of `costs`.
    PAPER (docs/explanation/method.md 7): the cheapest always wins (gain 0).
    """
    best = min(costs, key=lambda topology: costs[topology])
    if current not in costs or costs[best] < (1.0 - required_gain) * costs[current]:
        return best
    return current


class Planner:
    """Plans on belief snapshots. Its only memory is since when it has been asked about the same current topology."""

    def __init__(self, parameters: PlannerParameters, sensors: SensorSuite) -> None:
        self.parameters = parameters
        self.sensors = sensors
        self._builder = ProblemBuilder(parameters, sensors)
        self._held: tuple[Topology, int] | None = None

    def plan(
        self,
        belief: JointBelief,
        current: Topology,
        warm_start: Mapping[str, Array] | None,
        should_stop: Callable[[], bool],
        max_evaluations: int | None = None,
    ) -> PlanResult:
        """Return the best of the current topology and its neighbours; raises EstimatorFault for a broken belief.

        current: over the robots to plan for (those missing in the belief are ignored). The first solve is always
        finished; then `should_stop` is asked before each further one. A plan that was stopped is repeated exactly
        by giving its number of evaluations as `max_evaluations`.
        """
        current = current.reconciled(current.robots & frozenset(belief.layout.robots))
        scene = scene_from_belief(belief, current.robots)
        if not scene.robots or not scene.targets:
            return self._idle(current, belief.stamp_ns)
        search = _Search(should_stop, max_evaluations)
        candidates = [t for t in (current, *self.options(current)) if self.parameters.slots(len(t.levels))]
        if current not in candidates:
            candidates.insert(0, Topology.flat(current.robots))
        problems = {t: self._builder.build(scene, t) for t in dict.fromkeys(candidates)}
        warm = self._warm(scene, warm_start)
        self._optimise(search, scene, problems, warm)
        return self._result(belief.stamp_ns, scene, current, search, problems)

    def options(self, current: Topology) -> tuple[Topology, ...]:
        """Return the other topologies that a step looks at."""
        return current.neighbours()

    def _warm(self, scene: PlanningScene, warm_start: Mapping[str, Array] | None) -> Array:
        held = warm_start if warm_start and self.parameters.mode != "paper" else {}
        scale = self._builder.scale(scene)
        x = np.concatenate([np.asarray(held.get(name, np.zeros(3)), dtype=np.float64) for name in scene.robots]) / scale
        return np.where(np.isfinite(x), np.clip(x, -1.0, 1.0), 0.0)

    def _optimise(
        self, search: _Search, scene: PlanningScene, problems: dict[Topology, PlanningProblem], warm: Array
    ) -> None:
        first, *others = problems
        p = self.parameters
        search.add(problems[first].solve(warm, p.evaluation_budget, p.tolerance))
        best = search.solutions[first].controls / problems[first].scale
        queue = [(problems[first], start) for start in self._extra_starts(search, scene, problems[first], [best])]
        ranked = []
        for topology in others:
            if search.must_stop():
                return
            begin = [] if p.mode == "paper" else [best]
            chosen = self._extra_starts(search, scene, problems[topology], begin)
            ranked += [(problems[topology].value(start), problems[topology], start) for start in chosen]
        ranked.sort(key=lambda entry: entry[0])
        for problem, start in [*queue, *((problem, start) for _, problem, start in ranked)]:
            if search.must_stop():
                return
            search.add(problem.solve(start, p.evaluation_budget, p.tolerance))

    def _extra_starts(
        self, search: _Search, scene: PlanningScene, problem: PlanningProblem, known: list[Array]
    ) -> list[Array]:
        """Return the most promising starts of a topology; `known` ones of the current topology are not repeated."""
        p = self.parameters
        if p.mode == "paper":
            return [] if known else [np.zeros(problem.scale.size)]
        own = starts(scene, problem.topology, p, self.sensors, problem.scale)
        solved = problem.topology in search.solutions
        options = own if solved else known + own
        search.evaluations += len(options)
        options = sorted(options, key=problem.value)
        return options[: max(p.starts - solved, 0)]

    def _result(
        self,
        stamp_ns: int,
        scene: PlanningScene,
        current: Topology,
        search: _Search,
        problems: dict[Topology, PlanningProblem],
    ) -> PlanResult:
        costs = {topology: solution.cost for topology, solution in search.solutions.items()}
        best = search.solutions[choose(current, costs, self._required_gain(current, stamp_ns))]
        if not math.isfinite(best.cost):
            raise EstimatorFault("the expected uncertainty is not finite")
        slots = self.parameters.slots(len(best.topology.levels)) or ()
        status = "stopped" if search.stopped else "complete"
        report = SolverReport(status, search.evaluations, 0.0, len(problems), len(costs))
        names = problems[best.topology].edge_names
        return PlanResult(
            topology=best.topology,
            cost=best.cost,
            uncertainty=float(best.report[0]),
            controls={name: best.controls[3 * i : 3 * i + 3] for i, name in enumerate(scene.robots)},
            heights={name: slots[best.topology.level_of(name)] for name in scene.robots},
            edges=tuple(Edge(a, b, float(w)) for (a, b), w in zip(names, best.report[1:], strict=True)),
            alternatives=tuple(Alternative(str(t), cost) for t, cost in costs.items() if t != best.topology),
            solver=report,
            mode=self.parameters.mode,
            stamp_ns=stamp_ns,
        )

    def _required_gain(self, current: Topology, stamp_ns: int) -> float:
        if self._held is None or self._held[0] != current:
            self._held = (current, stamp_ns)
        if self.parameters.mode == "paper":
            return 0.0
        dwelt = stamp_ns - self._held[1] >= self.parameters.min_dwell_s * 1e9
        return self.parameters.hysteresis if dwelt else self.parameters.urgent_gain

    def _idle(self, current: Topology, stamp_ns: int) -> PlanResult:
        slots = self.parameters.slots(len(current.levels)) or ()
        heights = {name: slots[current.level_of(name)] for name in current.robots} if slots else {}
        report = SolverReport("idle", 0, 0.0, 0, 0)
        return PlanResult(current, 0.0, 0.0, {}, heights, (), (), report, self.parameters.mode, stamp_ns)

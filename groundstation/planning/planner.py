"""One planning step: optimises the current topology and its neighbours, chooses one, and gives the reason."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from inspect import signature
from typing import Any, ClassVar

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import Alternative, Edge, SolverReport
from groundstation.errors import EstimatorFault
from groundstation.estimation.belief import JointBelief
from groundstation.planning.answer import check_answer, check_message
from groundstation.planning.local_search import LocalSearch, Solution
from groundstation.planning.parameters import PlannerParameters
from groundstation.planning.problem import PlanningProblem, PlanningScene, ProblemBuilder, scene_from_belief
from groundstation.planning.records import HEIGHT, ROBOT_CONTROLS
from groundstation.planning.starts import Starts
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.topology import Topology


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """A snapshot to plan on, outside the tracker's loop; held: robots that follow no plan and stay in place."""

    belief: JointBelief
    topology: Topology
    warm_start: Mapping[str, Array]
    held: frozenset[str] = frozenset()

    def put_to(self, planner: Any, should_stop: Callable[[], bool], max_evaluations: int | None = None) -> "PlanResult":
        """Return the plan of a planner: `Planner`, or another package's, which gets `held` if it `takes_held`.

        Raises TypeError or ValueError for an answer that cannot be flown or published.
        """
        more = {"held": self.held} if getattr(planner, "takes_held", False) else {}
        scene = self.belief, self.topology, self.warm_start
        answer = planner.plan(*scene, should_stop, max_evaluations, **more)
        if not isinstance(answer, PlanResult):
            raise TypeError(f"a planner returns a PlanResult, not {answer!r}")
        check_answer(answer, self.topology.robots, self.belief.stamp_ns)
        if type(planner) is not Planner:  # ours needs no check, which takes 0.03 ms for two drones and 0.5 ms for ten
            check_message(answer)
        return answer


@dataclass(frozen=True, slots=True)
class PlanResult:
    """The chosen topology with held controls.

    cost [m^2]: with penalties; uncertainty [m^2]: the discounted trace alone. controls: (vx, vy, yaw rate) per robot
    [m/s, m/s, rad/s; base_stabilized]; heights: the height each robot goes to [m]. solver.status: complete | stopped
    (out of time or evaluations: the best so far) | idle (no robot or no target). solver.gap: to a lower bound over all
    topologies and controls. solver.seconds is left 0: the core has no clock.
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

    @property
    def warm_start(self) -> dict[str, Array]:
        """Return the controls, each followed by the height (4 per robot), as the start of the next plan."""
        return {name: np.append(u, self.heights[name]) for name, u in self.controls.items()}

    def halted(self, belief: JointBelief) -> "PlanResult":
        """Return the plan that keeps each robot where the belief has it."""
        names = [name for name in self.controls if name in belief.layout]
        heights = {name: float(belief.mean_of(name)[2]) for name in names}
        return replace(self, controls={name: np.zeros(HEIGHT) for name in names}, heights=heights)


@dataclass(slots=True)
class _Search:
    """State of one planning step: solutions so far, evaluations spent, and whether to stop."""

    should_stop: Callable[[], bool]
    max_evaluations: int | None
    parameters: PlannerParameters
    evaluations: int = 0
    stopped: bool = False
    least: float = 0.0
    solutions: dict[Topology, Solution] = field(default_factory=dict)
    problems: dict[Topology, PlanningProblem] = field(default_factory=dict)

    def must_stop(self) -> bool:
        spent = self.max_evaluations is not None and self.evaluations >= self.max_evaluations
        self.stopped = self.stopped or spent or self.should_stop()
        return self.stopped

    def value(self, problem: PlanningProblem, start: Array) -> float:
        self.evaluations += 1
        return problem.value(start)

    def solve(self, problem: PlanningProblem, start: Array) -> None:
        """Search for a local minimum until it is found or time is up; the best point so far counts."""
        p = self.parameters
        self.go_on(LocalSearch(problem, start, p.evaluation_budget, p.tolerance), p.evaluation_budget)

    def go_on(self, search: LocalSearch, until: int) -> None:
        """Continue a local search until it is over, has had `until` evaluations, or time is up."""
        while True:
            before = search.evaluations
            over = search.advance(until)
            self.evaluations += search.evaluations - before
            if self.must_stop() or over or search.evaluations >= until:
                break
        solution, problem = search.solution(), search.problem
        known = self.solutions.get(problem.topology)
        if known is None or solution.cost < known.cost:
            self.solutions[problem.topology], self.problems[problem.topology] = solution, problem


@dataclass(frozen=True, slots=True)
class _Ranked:
    """A start with its cost."""

    cost: float
    problem: PlanningProblem
    start: Array


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
    """Plans on belief snapshots. Its only memory is the time since when the topology has been the same.

    builder_of: makes the arrays of a problem; a different one changes the sightings that the cost assumes. takes_held:
    whether `plan` has the argument `held`.
    """

    takes_held: ClassVar[bool] = True

    def __init_subclass__(cls) -> None:
        # Subclasses in other packages may have a `plan` without `held`.
        cls.takes_held = "held" in signature(cls.plan).parameters

    def __init__(
        self,
        parameters: PlannerParameters,
        sensors: SensorSuite,
        builder_of: Callable[[PlannerParameters, SensorSuite], ProblemBuilder] = ProblemBuilder,
    ) -> None:
        self.parameters = parameters
        self.sensors = sensors
        self._builder = builder_of(parameters, sensors)
        self._held: tuple[Topology, int] | None = None

    def plan(
        self,
        belief: JointBelief,
        current: Topology,
        warm_start: Mapping[str, Array] | None,
        should_stop: Callable[[], bool],
        max_evaluations: int | None = None,
        held: frozenset[str] = frozenset(),
    ) -> PlanResult:
        """Return the best of the current topology and its neighbours; raises EstimatorFault for a broken belief.

        current: over the robots to plan for (those missing in the belief are ignored); held: those of them that stay in
        place, and only observe. `should_stop` is called after every few evaluations, some 0.3 ms for ten robots. A
        stopped plan is repeated exactly with its number of evaluations as `max_evaluations`.
        """
        current = current.reconciled(current.robots & frozenset(belief.layout.robots))
        scene = scene_from_belief(belief, current.robots, held)
        if not scene.robots or not scene.targets:
            return self._idle(current, belief.stamp_ns)
        search = _Search(should_stop, max_evaluations, self.parameters)
        first = current if self.parameters.level_heights(len(current.levels)) else Topology.flat(current.robots)
        others = [t for t in self.options(current) if self.parameters.level_heights(len(t.levels)) and t != first]
        self._optimise(search, scene, first, others, warm_start)
        return self._result(belief.stamp_ns, scene, current, search, 1 + len(others))

    def options(self, current: Topology) -> tuple[Topology, ...]:
        """Return the other topologies that a step considers."""
        return current.neighbours()

    def _warm(
        self, scene: PlanningScene, warm_start: Mapping[str, Array] | None, rest: Array, starts: Starts, scale: Array
    ) -> Array:
        """Return the start that continues the last plan, as far as that is known and finite."""
        held = warm_start if warm_start and self.parameters.mode != "paper" else {}
        x = rest.copy().reshape(-1, ROBOT_CONTROLS)
        for i, name in enumerate(scene.robots):
            last = np.asarray(held.get(name, ()), dtype=np.float64)
            x[i, : min(last.size, HEIGHT)] = (last / scale.reshape(x.shape)[i, : last.size])[:HEIGHT]
            if last.size > HEIGHT:
                x[i, HEIGHT] = starts.height(i, float(last[HEIGHT]))
        return np.where(np.isfinite(x), np.clip(x, -1.0, 1.0), 0.0).ravel()

    def _optimise(
        self,
        search: _Search,
        scene: PlanningScene,
        first: Topology,
        others: list[Topology],
        warm_start: Mapping[str, Array] | None,
    ) -> None:
        """Solve the first topology, then the starts of all others in the order of their costs."""
        problem = self._builder.build(scene, first)
        search.least = self._builder.lower_bound(scene, problem)
        starts = Starts(scene, self.parameters, self.sensors, problem.scale, self._builder.height_m)
        search.solve(problem, self._warm(scene, warm_start, starts.rest(first), starts, problem.scale))
        best = search.solutions[first].controls / problem.scale
        ranked: list[_Ranked] = []
        held = first.level_by_robot()
        for topology in (first, *others):
            if search.must_stop():
                return
            problem = self._builder.build(scene, topology)
            if search.must_stop():
                return
            if self.parameters.mode == "paper":
                ranked += [] if topology == first else [_Ranked(0.0, problem, starts.rest(topology))]
                continue
            moved = {name for name, level in topology.level_by_robot().items() if held[name] != level}
            own = starts.of(topology, None if topology == first else best, moved)
            ranked += self._ranked(search, problem, own)
        self._race(search, ranked)

    def _race(self, search: _Search, ranked: list["_Ranked"]) -> None:
        """Solve the likeliest starts for a few evaluations each, and the best of those to the end."""
        p = self.parameters
        if p.mode == "paper":
            for entry in ranked:
                if search.must_stop():
                    return
                search.solve(entry.problem, entry.start)
            return
        ranked.sort(key=lambda entry: entry.cost)
        runs: list[LocalSearch] = []
        for entry in ranked[: p.solves]:
            if search.must_stop():
                return
            runs.append(LocalSearch(entry.problem, entry.start, p.evaluation_budget, p.tolerance))
            search.go_on(runs[-1], p.first_look)
        runs.sort(key=lambda run: run.cost)
        for run in [run for run in runs if not run.over][: p.finals]:
            if search.must_stop():
                return
            search.go_on(run, p.evaluation_budget)

    def _ranked(self, search: _Search, problem: PlanningProblem, starts: list[Array]) -> list["_Ranked"]:
        """Return the most promising starts of a topology with their costs."""
        found = []
        for start in starts:
            found.append(_Ranked(search.value(problem, start), problem, start))
            if search.must_stop():
                break
        found.sort(key=lambda entry: entry.cost)
        left = self.parameters.starts - (problem.topology in search.solutions)
        return found[:left]

    def _result(
        self, stamp_ns: int, scene: PlanningScene, current: Topology, search: _Search, considered: int
    ) -> PlanResult:
        costs = {topology: solution.cost for topology, solution in search.solutions.items()}
        best = search.solutions[choose(current, costs, self._required_gain(current, stamp_ns))]
        if not math.isfinite(best.cost):
            raise EstimatorFault("the expected uncertainty is not finite")
        heights, rows = self._builder.heights(best.controls), best.controls.reshape(-1, ROBOT_CONTROLS)
        status = "stopped" if search.stopped else "complete"
        gap = max(0.0, 1.0 - search.least / best.cost)
        report = SolverReport(status, search.evaluations, 0.0, considered, len(costs), gap)
        names = self._builder.edge_names(scene, search.problems[best.topology])
        return PlanResult(
            topology=best.topology,
            cost=best.cost,
            uncertainty=float(best.report[0]),
            controls={name: row[:HEIGHT] for name, row in zip(scene.robots, rows, strict=True)},
            heights=dict(zip(scene.robots, heights, strict=True)),
            edges=tuple(Edge(a, b, float(w)) for (a, b), w in zip(names, best.report[1:], strict=False)),
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
        by_level = self.parameters.level_heights(len(current.levels)) or ()
        heights = {name: by_level[current.level_of(name)] for name in current.robots} if by_level else {}
        report = SolverReport("idle", 0, 0.0, 0, 0)
        return PlanResult(current, 0.0, 0.0, {}, heights, (), (), report, self.parameters.mode, stamp_ns)

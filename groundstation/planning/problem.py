"""Arrays for the kernels, from a belief and a topology."""

from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.errors import EstimatorFault
from groundstation.estimation.belief import JointBelief
from groundstation.kernel import Rows
from groundstation.planning.gradient import evaluate
from groundstation.planning.lbfgs import solve
from groundstation.planning.parameters import PlannerParameters
from groundstation.planning.records import CostOptions, CostProblem, EdgeRow
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.topology import LEAF, ROOT, Topology
from groundstation.sensing.visibility import camera_rows


@dataclass(frozen=True, slots=True)
class PlanningScene:
    """What all topologies of one planning step share: robots and targets of the belief, in state order.

    poses (n, 4) x, y, z, yaw; moving (k, 4) x, y, vx, vy; prior (3 n + 4 k square): x, y, yaw per robot, targets.
    """

    robots: tuple[str, ...]
    targets: tuple[str, ...]
    poses: Array
    moving: Array
    prior: Array


def scene_from_belief(belief: JointBelief, robots: frozenset[str]) -> PlanningScene:
    """Return the scene of the given robots and all targets; raises EstimatorFault for an indefinite covariance.

    Heights and any calibration entries are marginalised: the planner's noise is isotropic, so that they inform neither
    position nor heading.
    """
    names = tuple(name for name in belief.layout.robots if name in robots)
    targets = belief.layout.targets
    chosen: list[int] = []
    for name in names:
        start = belief.layout.block(name).start
        chosen += [start, start + 1, start + 3]
    for name in targets:
        start = belief.layout.block(name).start
        chosen += range(start, start + 4)
    prior = np.ascontiguousarray(belief.covariance[np.ix_(chosen, chosen)])
    prior = 0.5 * (prior + prior.T)
    if chosen and np.linalg.eigvalsh(prior)[0] < -1e-9 * max(1.0, float(prior.max())):
        raise EstimatorFault("the belief's covariance is not positive semidefinite")
    poses = np.array([belief.mean_of(name)[:4] for name in names]).reshape(-1, 4)
    moving = np.array([belief.mean_of(name)[:4] for name in targets]).reshape(-1, 4)
    return PlanningScene(names, targets, poses, moving, prior)


@dataclass(frozen=True, slots=True)
class PlanningProblem:
    """One topology's optimisation: minimise over x in [-1, 1]^(3 n), u = x * scale."""

    topology: Topology
    cost: CostProblem
    edge_names: tuple[tuple[str, str], ...]

    @property
    def scale(self) -> Array:
        """Return the bounds of the controls (3 n)."""
        return self.cost.scale

    def value(self, x: Array) -> float:
        """Return the cost at x."""
        scratch, report = np.empty(x.size), np.empty(1 + len(self.edge_names))
        return float(evaluate(x * self.scale, self.cost, False, scratch, report))

    def solve(self, start: Array, budget: int, tolerance: float) -> "Solution":
        """Return the local minimum that is reached from a start."""
        x, report = np.clip(start, -1.0, 1.0), np.empty(1 + len(self.edge_names))
        cost, evaluations = solve(x, self.cost, budget, tolerance, report)
        return Solution(self.topology, float(cost), x * self.scale, int(evaluations), report)


@dataclass(frozen=True, slots=True)
class Solution:
    """Controls u (3 n) with their cost; report (1 + m): the uncertainty alone, each edge's mean information."""

    topology: Topology
    cost: float
    controls: Array
    evaluations: int
    report: Array


class ProblemBuilder:
    """Turns a scene and a topology into arrays; built once per planner."""

    def __init__(self, parameters: PlannerParameters, sensors: SensorSuite) -> None:
        self._parameters = parameters
        self._sensors = sensors
        self._world = {name: row for row, name in enumerate(sensors.world)}
        self._onboard = {name: row for row, name in enumerate(sensors.onboard, start=len(self._world))}
        self._cameras = camera_rows([*sensors.world.values(), *sensors.onboard.values()], sensors.softness)
        p, low, high = parameters, parameters.fence_margin_m, -parameters.fence_margin_m
        self._options = CostOptions(
            p.step_s, p.discount, p.noise.robot_position, p.noise.robot_yaw, p.noise.target_acceleration,
            p.weights.repulsion, p.separation_m, p.weights.fence,
            np.array([[p.fence.x_m[0] + low, p.fence.x_m[1] + high], [p.fence.y_m[0] + low, p.fence.y_m[1] + high]]),
            p.weights.effort, p.weights.robots,
        )  # fmt: skip

    def build(self, scene: PlanningScene, topology: Topology) -> PlanningProblem:
        """Return the topology's problem; it must have height slots."""
        edges, names = self._edges(scene, topology)
        cost = CostProblem(
            scale=self.scale(scene), poses=scene.poses, targets=scene.moving, heights=self._heights(scene, topology),
            prior=scene.prior, edges=edges, cameras=self._cameras,
            markers=np.array([self._sensors.marker_height_m[name] for name in scene.robots + scene.targets]),
            target_weights=np.array([self._parameters.target_weights.get(name, 1.0) for name in scene.targets]),
            options=self._options,
        )  # fmt: skip
        return PlanningProblem(topology, cost, names)

    def scale(self, scene: PlanningScene) -> Array:
        """Return the bounds of the controls: any corner of the box respects the speed limit."""
        limits = [self._parameters.limits_of(name) for name in scene.robots]
        return np.array([v for m in limits for v in (m.max_speed_m_s / 2**0.5,) * 2 + (m.max_yaw_rate_rad_s,)])

    def _heights(self, scene: PlanningScene, topology: Topology) -> Array:
        slots = self._parameters.slots(len(topology.levels))
        if slots is None:
            raise ValueError(f"no height slots for {topology}")
        goal = np.array([slots[topology.level_of(name)] for name in scene.robots])
        climb = np.array([self._parameters.limits_of(name).max_climb_m_s for name in scene.robots])
        ahead = self._parameters.step_s * np.arange(1, self._parameters.horizon_steps + 1)[:, None]
        way = goal - scene.poses[:, 2]
        heights: Array = scene.poses[:, 2] + np.clip(way, -climb * ahead, climb * ahead)
        return heights

    def _edges(self, scene: PlanningScene, topology: Topology) -> tuple[Rows[EdgeRow], tuple[tuple[str, str], ...]]:
        number = {name: index for index, name in enumerate(scene.robots + scene.targets)}
        rows: list[tuple[int, int, int]] = []
        names: list[tuple[str, str]] = []
        for observer, subject in topology.edges():
            subjects = scene.targets if subject == LEAF else (subject,)
            for row, index, name in self._eyes(observer, number):
                rows += [(row, index, number[s]) for s in subjects]
                names += [(name, s) for s in subjects]
        edges = EdgeRow.rows(len(rows))
        for column, values in zip(("camera", "observer", "subject"), zip(*rows, strict=True), strict=False):
            edges[column] = values
        return edges, tuple(names)

    def _eyes(self, observer: str, number: dict[str, int]) -> list[tuple[int, int, str]]:
        if observer == ROOT:
            return [(row, -1, name) for name, row in self._world.items()]
        return [(self._onboard[observer], number[observer], observer)] if observer in self._onboard else []

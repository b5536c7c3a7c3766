"""Arrays for the kernels, from a belief and a topology."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from groundstation.arrays import Array, IntArray
from groundstation.errors import EstimatorFault
from groundstation.estimation.belief import JointBelief
from groundstation.kernel import Rows
from groundstation.planning.bound import lower_bound
from groundstation.planning.gradient import evaluate
from groundstation.planning.parameters import MotionLimits, PlannerParameters
from groundstation.planning.records import HEIGHT, ROBOT_CONTROLS, TARGET_STATES, CostOptions, CostProblem, EdgeRow
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.occlusion import box_rows
from groundstation.sensing.topology import Topology
from groundstation.sensing.visibility import camera_rows

_HELD = 0.01  # share of its limits left to a robot that stays in place: the search divides by them
_LEAST_BAND_M = 1e-3  # least range of heights, if the field names only one
_FLOPS_PER_CHECK = 1.5e6  # some 0.3 ms: computation between two time checks
_FLOPS_PER_EDGE = 300.0


@dataclass(frozen=True, slots=True)
class PlanningScene:
    """The inputs common to all topologies of one planning step: robots and targets of the belief, in state order.

    poses (n, 4) x, y, z, yaw; moving (k, 4) x, y, vx, vy; prior (n + 2 k square): positions of robots, then position
    and velocity of each target, per axis; yaw_variances (n) [rad^2]; held: robots that stay in place.
    """

    robots: tuple[str, ...]
    targets: tuple[str, ...]
    poses: Array
    moving: Array
    prior: Array
    yaw_variances: Array
    held: frozenset[str] = frozenset()


def scene_from_belief(belief: JointBelief, robots: frozenset[str], held: frozenset[str] = frozenset()) -> PlanningScene:
    """Return the scene of the given robots and all targets; raises EstimatorFault for an indefinite covariance.

    Both axes get the mean of their covariances, which is a covariance too. Heights and calibration entries are
    marginalised: the planner's noise is isotropic, so they inform neither position nor heading.
    """
    names = tuple(name for name in belief.layout.robots if name in robots)
    targets, block = belief.layout.targets, belief.layout.block
    first = [block(name).start for name in names]
    x = [*first, *(block(name).start + part for name in targets for part in (0, 2))]
    chosen = np.array([*x, *(at + 1 for at in x), *(at + 3 for at in first)], dtype=np.int64)
    full = belief.covariance[np.ix_(chosen, chosen)]
    full = 0.5 * (full + full.T)
    if not np.isfinite(full).all():
        raise EstimatorFault("the belief's covariance is not finite")
    if chosen.size and np.linalg.eigvalsh(full)[0] < -1e-9 * max(1.0, float(full.max())):
        raise EstimatorFault("the belief's covariance is not positive semidefinite")
    d = len(x)
    prior: Array = np.ascontiguousarray(0.5 * (full[:d, :d] + full[d : 2 * d, d : 2 * d]))
    yaws: Array = np.diag(full)[2 * d :].copy()
    poses = np.array([belief.mean_of(name)[:4] for name in names]).reshape(-1, 4)
    moving = np.array([belief.mean_of(name)[:4] for name in targets]).reshape(-1, 4)
    return PlanningScene(names, targets, poses, moving, prior, yaws, held)


@dataclass(frozen=True, slots=True)
class PlanningProblem:
    """One topology's optimisation: minimise over x in [-1, 1]^(4 n), u = x * scale.

    wanted: number of edges of the topology; these come first.
    """

    topology: Topology
    cost: CostProblem
    wanted: int

    @property
    def scale(self) -> Array:
        """Return the bounds of the controls (4 n)."""
        return self.cost.scale

    @property
    def evaluations_at_once(self) -> int:
        """Return the number of evaluations between two time checks."""
        steps, d = self.cost.options.steps, self.cost.prior.shape[0]
        flops = steps * (12.0 * d**3 + _FLOPS_PER_EDGE * len(self.cost.edges))
        return max(1, min(10, int(_FLOPS_PER_CHECK / flops)))

    def value(self, x: Array) -> float:
        """Return the cost at x."""
        scratch, report = np.empty(x.size), np.empty(1 + len(self.cost.edges))
        return float(evaluate(x * self.scale, self.cost, False, scratch, report))


@dataclass(frozen=True, slots=True)
class _Pairs:
    """All ordered pairs of a camera and a subject that it may see, as rows and columns of a table."""

    rows: Rows[EdgeRow]
    observer: IntArray
    subject: IntArray


class ProblemBuilder:
    """Turns a scene and a topology into arrays; built once per planner."""

    def __init__(self, parameters: PlannerParameters, sensors: SensorSuite) -> None:
        self._parameters = parameters
        self._sensors = sensors
        self._world = {name: row for row, name in enumerate(sensors.world)}
        self._onboard = {name: row for row, name in enumerate(sensors.onboard, start=len(self._world))}
        self.eyes = (*sensors.world, *sensors.onboard)
        self._cameras = camera_rows([*sensors.world.values(), *sensors.onboard.values()], sensors.softness)
        self._boxes = box_rows(sensors.obstacles)
        p, low, high = parameters, parameters.fence_margin_m, -parameters.fence_margin_m
        bottom, top = parameters.heights_m
        self.height_m, self._half_m = 0.5 * (bottom + top), max(0.5 * (top - bottom), _LEAST_BAND_M)
        self._options = CostOptions(
            p.horizon_steps, p.step_s, p.discount,
            p.noise.robot_position, p.noise.robot_yaw, p.noise.target_acceleration,
            p.weights.repulsion, p.separation_m, p.weights.fence,
            np.array([[p.fence.x_m[0] + low, p.fence.x_m[1] + high], [p.fence.y_m[0] + low, p.fence.y_m[1] + high]]),
            p.obstacle_m,
            p.weights.effort, p.weights.robots, max(1.0, sensors.sightings_per_s * p.step_s), self.height_m,
        )  # fmt: skip
        self._of: PlanningScene | None = None

    def build(self, scene: PlanningScene, topology: Topology) -> PlanningProblem:
        """Return the topology's problem."""
        if scene is not self._of:
            self._share(scene)
        edges, wanted = self._edges(scene, topology)
        cost = CostProblem(
            scale=self._scale, poses=scene.poses, targets=scene.moving, climbs=self._climbs, prior=scene.prior,
            yaw_variances=scene.yaw_variances, edges=edges, cameras=self._cameras, markers=self._markers,
            target_weights=self._target_weights, boxes=self._boxes, options=self._options,
        )  # fmt: skip
        return PlanningProblem(topology, cost, wanted)

    def lower_bound(self, scene: PlanningScene, problem: PlanningProblem) -> float:
        """Return a lower bound of the cost over all topologies and controls on this scene."""
        held = problem.scale.reshape(-1, ROBOT_CONTROLS)
        reach = self._parameters.step_s * np.hypot(held[:, 0], held[:, 1])
        bottom, top = self._parameters.heights_m
        low, high = np.minimum(scene.poses[:, 2], bottom), np.maximum(scene.poses[:, 2], top)
        return float(lower_bound(problem.cost._replace(edges=self._pairs.rows), reach, low, high))

    def scale(self, scene: PlanningScene) -> Array:
        """Return the bounds of the controls: any corner of the box respects the speed limit."""
        limits = self._limits(scene)
        rows = [(m.max_speed_m_s / 2**0.5,) * 2 + (m.max_yaw_rate_rad_s, self._half_m) for m in limits]
        return np.array(rows, dtype=np.float64).ravel()

    def _limits(self, scene: PlanningScene) -> list[MotionLimits]:
        """Return the limits of each robot of a scene; next to nothing for one that stays in place."""
        limits = {name: self._parameters.limits_of(name) for name in scene.robots}
        for name in scene.held.intersection(scene.robots):
            own = limits[name]
            limits[name] = MotionLimits(
                _HELD * own.max_speed_m_s, _HELD * own.max_climb_m_s, _HELD * own.max_yaw_rate_rad_s
            )
        return list(limits.values())

    def heights(self, controls: Array) -> list[float]:
        """Return the heights of controls (4 n) [m]."""
        return [self.height_m + float(height) for height in controls[HEIGHT::ROBOT_CONTROLS]]

    def edge_names(self, scene: PlanningScene, problem: PlanningProblem) -> list[tuple[str, str]]:
        """Return observer and subject of each edge of the topology."""
        names, edges = scene.robots + scene.targets, problem.cost.edges
        rows = zip(edges["camera"].tolist(), edges["subject"].tolist(), strict=True)
        return [(self.eyes[camera], names[subject]) for camera, subject in list(rows)[: problem.wanted]]

    def _share(self, scene: PlanningScene) -> None:
        """Prepare the data common to all topologies of a scene."""
        self._of, self._scale = scene, self.scale(scene)
        self._markers = np.array([self._sensors.marker_height_m[name] for name in scene.robots + scene.targets])
        self._target_weights = np.array([self._parameters.target_weights.get(name, 1.0) for name in scene.targets])
        self._climbs = np.array([limits.max_climb_m_s for limits in self._limits(scene)])
        self._pairs = self._all_pairs(scene)

    def _all_pairs(self, scene: PlanningScene) -> _Pairs:
        n, everyone = len(scene.robots), range(len(scene.robots) + len(scene.targets))
        triples = [
            (row, -1, subject)
            for name, row in self._world.items()
            for subject in everyone
            if subject < n or self._sensors.world[name].observes_targets
        ]
        for index, name in enumerate(scene.robots):
            if (row := self._onboard.get(name)) is not None:
                triples += [(row, index, subject) for subject in everyone if subject != index]
        camera, observer, subject = np.array(triples, dtype=np.int64).reshape(-1, 3).T
        rows = EdgeRow.rows(len(triples))
        rows["camera"], rows["observer"], rows["subject"] = camera, observer, subject
        at = np.where(subject < n, subject, n + TARGET_STATES * (subject - n))
        fixed, P, q = observer < 0, scene.prior, np.diag(scene.prior)
        rows["blur_m2"] = q[at] + np.where(fixed, 0.0, q[observer] - 2.0 * P[observer, at])
        rows["turn_rad2"] = np.where(fixed, 0.0, scene.yaw_variances[observer]) + self._cameras["per_m"][camera] ** 2
        return _Pairs(rows, observer, subject)

    def _levels(self, scene: PlanningScene, topology: Topology) -> IntArray:
        level = topology.level_by_robot()
        return np.array([level[name] for name in scene.robots], dtype=np.int64)

    def _edges(self, scene: PlanningScene, topology: Topology) -> tuple[Rows[EdgeRow], int]:
        """Return all edges from a level to any below it, those of the topology first; and the number of these."""
        n, last, level = len(scene.robots), len(topology.levels) - 1, self._levels(scene, topology)
        a, b, pairs = self._pairs.observer, self._pairs.subject, self._pairs.rows
        fixed, robot = a < 0, b < n
        above = np.where(fixed, -1, level[a])
        below = np.where(robot, level[np.minimum(b, n - 1)], last + 1)
        wanted = above + 1 == below
        order = np.concatenate((np.flatnonzero(wanted), np.flatnonzero((above < below) & ~wanted)))
        edges: Any = cast(Any, pairs)[order]
        count = int(wanted.sum())
        edges["wanted"][:count] = 1
        return edges, count

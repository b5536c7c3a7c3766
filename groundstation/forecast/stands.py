"""Finds a team's stand for a target at one place, and the target's deviation there."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.forecast.team import Place, Team
from groundstation.forecast.views import Chain, Link, Obstruction, Views
from groundstation.planning.planner import Planner
from groundstation.planning.problem import PlanningScene, ProblemBuilder
from groundstation.planning.records import HEIGHT, ROBOT_CONTROLS, YAW, X, Y, Z
from groundstation.planning.rollout import empty_tape, roll_out
from groundstation.sensing.topology import Topology

_ROUNDS, _SETTLED_M = 3, 0.2  # most plans until the team is settled: the last one moves it less than this
_RESTS = 3  # horizons at the stand after which the covariance is constant
_BEHIND_M, _APART_RAD = 1.0, math.radians(80.0)  # first places: towards the room's middle, side by side
_ROBOT_STD_M, _YAW_STD, _TARGET_STD_M, _SPEED_STD_M_S = 0.05, 0.05, 0.1, 0.2


@dataclass(frozen=True, slots=True)
class TeamStand:
    """The team's stand: poses (x, y, z, yaw) [m, rad; world], and its knowledge there.

    std_m: of the target's place in the floor plan, root of the trace; placed: those that fixed cameras see, directly or
    through drones in their view; is_left: whether the planner alone would leave it for one where nobody places the
    target, so that only flight's rule of staying within reach of a view (decision 0165) keeps the team there.
    """

    place: Place
    topology: Topology
    poses: Mapping[str, Array]
    std_m: float
    placed: frozenset[str]
    is_left: bool = False


class _Held(Planner):
    """A planner that considers only the present topology."""

    def options(self, current: Topology) -> tuple[Topology, ...]:
        """Return no other topology."""
        return ()


class StandSearch:
    """Finds stands with the planner that flies, and judges them by its rollout."""

    def __init__(self, team: Team) -> None:
        self.team, self.views = team, Views(team)
        self._parameters = replace(team.planner, min_dwell_s=0.0, hysteresis=0.0)
        # Without the tail of the attraction, which carries no information.
        soft = replace(team.sensors.softness, tail_share=0.0)
        self._judge = ProblemBuilder(team.planner, replace(team.sensors, softness=soft))

    def at(self, place: Place) -> TeamStand | Obstruction:
        """Return the team's best stand for a standing target at a place, or the obstruction that hides it.

        Raises EstimatorFault when the expected uncertainty is not finite.
        """
        chain = self.views.chain_to(place)
        if isinstance(chain, Obstruction):
            return chain
        scene, topology = self._start(place, chain)
        stood = self._rested(place, scene, topology)
        planned = self._planned(place, scene, topology, Planner(self._parameters, self.team.sensors))
        if self.team.target not in planned.placed:
            return replace(stood, is_left=True) if self.team.target in stood.placed else Obstruction.NOBODY_PLACES
        return min((one for one in (planned, stood) if self.team.target in one.placed), key=lambda one: one.std_m)

    def held(self, place: Place, topology: Topology) -> TeamStand:
        """Return the team's stand in a topology that may not change, whether or not it sees the target there.

        It starts from a chain to the place, if that has as many drones as the topology has levels.
        """
        chain = self.views.chain_to(place)
        if isinstance(chain, Obstruction) or len(chain) != len(topology.levels):
            chain = ()
        lowest_first = reversed([min(level) for level in topology.levels])
        roles = tuple(Link(name, link.pose) for name, link in zip(lowest_first, chain, strict=False))
        scene, _ = self._start(place, roles)
        return self._planned(place, scene, topology, _Held(self._parameters, self.team.sensors))

    def _planned(self, place: Place, scene: PlanningScene, topology: Topology, planner: Planner) -> TeamStand:
        """Return the stand that the planner reaches."""
        warm = None
        for _ in range(_ROUNDS):
            plan = planner.plan(_belief_of(scene), topology, warm, lambda: False)
            topology, warm = plan.topology, plan.warm_start
            controls = np.array([warm[name] for name in scene.robots])
            controls[:, HEIGHT] -= self._judge.height_m
            before, scene = scene.poses, self._after(scene, topology, controls)
            if np.abs(scene.poses[:, :3] - before[:, :3]).max() < _SETTLED_M:
                break
        return self._rested(place, scene, topology)

    def _rested(self, place: Place, scene: PlanningScene, topology: Topology) -> TeamStand:
        """Return the stand with its deviations after the team has stood for a while."""
        rest = np.zeros((len(scene.robots), ROBOT_CONTROLS))
        rest[:, HEIGHT] = scene.poses[:, 2] - self._judge.height_m
        for _ in range(_RESTS):
            scene = self._after(scene, topology, rest)
        stds, poses = np.sqrt(2.0 * np.diag(scene.prior)).tolist(), dict(zip(scene.robots, scene.poses, strict=True))
        return TeamStand(place, topology, poses, stds[len(poses)], self.views.placed(poses, place))

    def _start(self, place: Place, chain: Chain) -> tuple[PlanningScene, Topology]:
        """Return a chain at its stands, all others beside each other between the target and the middle of the fence."""
        robots, fence = self.team.robots, self.team.planner.fence
        stands = {link.robot: link.pose for link in chain}
        inside, (mx, my) = fence.shrunk(self.team.planner.fence_margin_m), fence.center
        inwards = math.atan2(my - place[1], mx - place[0])
        poses = np.empty((len(robots), 4))
        for i, name in enumerate(robots):
            bearing = inwards + _APART_RAD * (i - 0.5 * (len(robots) - 1))
            x, y = place[0] + _BEHIND_M * math.cos(bearing), place[1] + _BEHIND_M * math.sin(bearing)
            x, y = inside.nearest(x, y)
            height = self.team.planner.level_heights_m[0][0]
            poses[i] = stands.get(name, (x, y, height, math.atan2(place[1] - y, place[0] - x)))
        prior = np.diag([_ROBOT_STD_M**2] * len(robots) + [_TARGET_STD_M**2, _SPEED_STD_M_S**2])
        moving = np.array([[*place, 0.0, 0.0]])
        scene = PlanningScene(robots, (self.team.target,), poses, moving, prior, np.full(len(robots), _YAW_STD**2))
        above = Topology.string(reversed([link.robot for link in chain]))
        return scene, above.reconciled(robots)

    def _after(self, scene: PlanningScene, topology: Topology, controls: Array) -> PlanningScene:
        """Return the scene after one horizon of held controls (n, 4); the target stands still."""
        problem = self._judge.build(scene, topology).cost
        d = problem.prior.shape[0]
        tape = empty_tape(len(scene.robots), problem.options.steps, len(problem.edges), d)
        roll_out(controls.ravel(), problem, tape)
        poses = tape.path[-1][:, [X, Y, Z, YAW]].copy()
        covariance = tape.covariances[-1, :d, :d]
        prior = np.ascontiguousarray(0.5 * (covariance + covariance.T))
        return replace(scene, poses=poses, prior=prior, yaw_variances=tape.yaws_after[-1].copy())


def _belief_of(scene: PlanningScene) -> JointBelief:
    """Return the belief of a scene, with known heights."""
    layout, n = StateLayout(), len(scene.robots)
    for names, kind, core in (
        (scene.robots, EntityKind.ROBOT, ROBOT_CORE),
        (scene.targets, EntityKind.TARGET, TARGET_CORE),
    ):
        for name in names:
            layout = layout.with_entity(name, kind, core)
    x = np.array([*(4 * i for i in range(n)), 4 * n, 4 * n + 2])
    covariance = np.zeros((layout.dim, layout.dim))
    for axis in (0, 1):
        covariance[np.ix_(x + axis, x + axis)] = scene.prior
    yaws = 4 * np.arange(n) + 3
    covariance[yaws, yaws] = scene.yaw_variances
    return JointBelief(np.concatenate((scene.poses.ravel(), scene.moving.ravel())), covariance, layout, 0)

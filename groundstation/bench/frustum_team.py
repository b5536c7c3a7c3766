"""A team in a hall that flies the planner's plans, for beliefs as in flight."""

import math
from dataclasses import replace

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.planning.parameters import PlannerParameters
from groundstation.planning.planner import Planner, PlanResult
from groundstation.sensing.models import Frustum, OnboardCameraModel, Rectangle, SensorSuite, WorldCameraModel
from groundstation.sensing.topology import Topology

STEP_S = 0.1
TARGET = "target"
_LEVELS = {"flat": 1, "two-level": 2, "string": 4}
_SPEED_M_S = 0.3
_SHARE = 0.9  # of the pictures in view that show their marker


class FrustumTeam:
    """Robots with tilted cameras, ceiling cameras over the middle of a hall, a target on a figure of eight.

    Robots follow their controls; the covariance is an EKF's with hard fields of view: every pair that is seen is fused.
    """

    def __init__(self, robots: int, layout: str, seed: int) -> None:
        self._rng, n = np.random.default_rng(seed), robots
        self.names = tuple(f"drone_{index:02d}" for index in range(n))
        self.half_m = max(2.0, 0.9 * math.sqrt(n))
        self.planner = Planner(self._parameters(), self._sensors())
        levels = [self.names[start :: min(n, _LEVELS[layout])] for start in range(min(n, _LEVELS[layout]))]
        self.topology = Topology(tuple(frozenset(level) for level in levels))
        state = StateLayout()
        for name in self.names:
            state = state.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
        self._layout = state.with_entity(TARGET, EntityKind.TARGET, TARGET_CORE)
        places = self._rng.uniform(-self.half_m, self.half_m, (n, 2))
        heights = [self._heights(self.topology)[name] for name in self.names]
        self._mean = np.concatenate(
            [np.column_stack([places, heights, self._rng.uniform(-3.0, 3.0, n)]).ravel(), [0.0, 0.0, 0.2, 0.2]]
        )
        self._P = np.diag([0.05**2, 0.05**2, 0.04**2, 0.05**2] * n + [0.1**2] * 2 + [0.2**2] * 2)
        self._now_s = 0.0
        self.plan: PlanResult | None = None

    def _parameters(self) -> PlannerParameters:
        rows = tuple(tuple(np.linspace(2.6, 1.1, count).tolist()) if count > 1 else (1.6,) for count in range(1, 6))
        edge = self.half_m + 1.0
        return PlannerParameters(level_heights_m=rows, step_s=0.3, fence=Rectangle((-edge, edge), (-edge, edge)))

    def _sensors(self) -> SensorSuite:
        picture, ceiling = Frustum.of_picture(640, 360, 460, 460, 1.9), Frustum.of_picture(1280, 720, 1179, 1179, 5.0)
        count = max(1, len(self.names) // 10)
        world = {
            f"ceiling_{k}": WorldCameraModel((3.0 * k - 1.5 * (count - 1), 0.0, 4.2), ceiling) for k in range(count)
        }
        onboard = {name: OnboardCameraModel((0.09, 0.0, 0.0), picture) for name in self.names}
        return SensorSuite(world, onboard, {**dict.fromkeys(self.names, 0.08), TARGET: 0.4})

    def _heights(self, topology: Topology) -> dict[str, float]:
        heights = self.planner.parameters.level_heights(len(topology.levels)) or ()
        return {name: heights[topology.level_of(name)] for name in topology.robots}

    @property
    def belief(self) -> JointBelief:
        """Return the present belief."""
        return JointBelief(self._mean.copy(), self._P.copy(), self._layout, round(self._now_s * 1e9))

    @property
    def warm_start(self) -> dict[str, Array] | None:
        """Return the present controls, with the heights."""
        return None if self.plan is None else self.plan.warm_start

    def fly(self, plan: PlanResult) -> None:
        """Follow a plan for one step, and fuse all sightings."""
        self.plan, self.topology = plan, plan.topology
        self._move(plan)
        self._now_s += STEP_S
        for index, name in enumerate(self.names):
            self._see(index, name)

    def _move(self, plan: PlanResult) -> None:
        n, dt, noise = len(self.names), STEP_S, self.planner.parameters.noise
        F, q = np.eye(4 * n + 4), np.zeros(4 * n + 4)
        for index, name in enumerate(self.names):
            pose = self._mean[4 * index : 4 * index + 4]
            vx, vy, rate = plan.controls[name]
            c, s = math.cos(pose[3]), math.sin(pose[3])
            step = dt * np.array([c * vx - s * vy, s * vx + c * vy])
            F[4 * index : 4 * index + 2, 4 * index + 3] = -step[1], step[0]
            climb = max(-0.4 * dt, min(0.4 * dt, plan.heights[name] - pose[2]))
            pose += [step[0], step[1], climb, rate * dt]
            q[4 * index : 4 * index + 4] = noise.robot_position, noise.robot_position, 1e-4, noise.robot_yaw
        F[4 * n, 4 * n + 2] = F[4 * n + 1, 4 * n + 3] = dt
        q[4 * n + 2 :] = noise.target_acceleration
        angle = _SPEED_M_S / self.half_m * self._now_s
        velocity = _SPEED_M_S * np.array([math.cos(angle), math.cos(2.0 * angle)]) / math.sqrt(2.0)
        self._mean[4 * n : 4 * n + 2] += dt * velocity
        self._mean[4 * n + 2 :] = velocity
        self._P = F @ self._P @ F.T + np.diag(q * dt)

    def _see(self, index: int, name: str) -> None:
        """Fuse the sightings by a robot's camera, and those of it from the ceiling."""
        n, sensors, pose = len(self.names), self.planner.sensors, self._mean[4 * index : 4 * index + 4]
        own = sensors.marker(name, pose, is_robot=True)
        for camera, eye in sensors.world.items():
            if sensors.world_in_view(camera, own) and self._rng.random() < _SHARE:
                std = eye.noise.position_std_m(float(np.linalg.norm(own - eye.position_m)))
                self._correct(np.eye(4 * n + 4)[4 * index : 4 * index + 4], [std, std, std, eye.noise.yaw_rad])
        noise = sensors.onboard[name].noise
        for other in range(n + 1):
            start, is_robot = 4 * other, other < n
            marker = sensors.marker((*self.names, TARGET)[other], self._mean[start : start + 4], is_robot)
            seen = other != index and sensors.onboard_in_view(name, pose, marker)
            if not seen or self._rng.random() >= _SHARE:
                continue
            d = self._mean[start : start + 2] - pose[:2]
            H = np.zeros((3 if is_robot else 2, 4 * n + 4))
            H[:2, start : start + 2] = np.eye(2)
            H[:2, 4 * index : 4 * index + 2] = -np.eye(2)
            H[:2, 4 * index + 3] = d[1], -d[0]
            if is_robot:
                H[2, start + 3], H[2, 4 * index + 3] = 1.0, -1.0
            std = noise.position_std_m(float(np.linalg.norm(marker - pose[:3])))
            self._correct(H, [std, std, noise.yaw_rad][: len(H)])

    def _correct(self, H: Array, stds: list[float]) -> None:
        PH = self._P @ H.T
        P = self._P - PH @ np.linalg.solve(H @ PH + np.diag(np.square(stds)), PH.T)
        self._P = 0.5 * (P + P.T)


def settled(robots: int, layout: str, seed: int, seconds: float) -> FrustumTeam:
    """Return a team that has flown for some seconds; each plan has a few hundred evaluations, to be quick."""
    team = FrustumTeam(robots, layout, seed)
    hasty = Planner(replace(team.planner.parameters, solves=2, finals=1), team.planner.sensors)
    for _ in range(round(seconds / STEP_S)):
        team.fly(hasty.plan(team.belief, team.topology, team.warm_start, lambda: False, max_evaluations=100))
    return team

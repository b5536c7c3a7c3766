"""Planner, setpoints and safety in closed loop with kinematic robots and hard-edged sensors; no wire, no processes."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.arrays import Array
from groundstation.bus.messages import Header, SearchedPicture
from groundstation.control.lookout import Lookout
from groundstation.control.moment import Sight
from groundstation.control.output_limiter import limit_setpoint
from groundstation.control.parameters import control_from_field, safety_from_field
from groundstation.control.search_parameters import search_from_field
from groundstation.control.setpoints import setpoints_from_plan
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.angles import wrap
from groundstation.geometry.stabilized_frame import world_from_stabilized
from groundstation.planning.parameters import parameters_from_field
from groundstation.planning.planner import Planner, PlanResult
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.topology import Topology
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.scenario import load_scenario

CONFIG = Path(__file__).parents[2] / "config"
STEP_S = 0.02
LAG_S = 0.3
E2 = np.array([[0.0, -1.0], [1.0, 0.0]])


def figure_eight(path: dict[str, Any], duration_s: float) -> Array:
    """Return the target's (x, y) every STEP_S, at constant speed from the centre."""
    s = np.linspace(0, 2 * math.pi, 4000)
    line = np.column_stack([path["half_length_m"] * np.sin(s), path["half_width_m"] * np.sin(2 * s)])
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    along = np.arange(0, duration_s, STEP_S) * path["speed_m_s"] % length[-1]
    return np.column_stack([np.interp(along, length, line[:, i]) for i in range(2)])


@dataclass
class Trace:
    times: list[float] = field(default_factory=list)
    truth: list[Array] = field(default_factory=list)
    target: list[Array] = field(default_factory=list)
    error: list[float] = field(default_factory=list)
    seen: list[bool] = field(default_factory=list)
    topologies: list[str] = field(default_factory=list)
    limited: list[tuple[str, ...]] = field(default_factory=list)

    def longest_loss_s(self) -> float:
        worst = run = 0
        for seen in self.seen:
            run = 0 if seen else run + 1
            worst = max(worst, run)
        return worst * STEP_S

    def seconds(self, levels: int) -> float:
        return STEP_S * sum(t.count("/") + 1 == levels for t in self.topologies)

    def switches(self) -> int:
        return sum(a != b for a, b in zip(self.topologies, self.topologies[1:], strict=False))

    def separation_m(self) -> float:
        n = len(self.truth[0])
        pairs = [(a, b) for a in range(n) for b in range(a)]
        return float(min(np.linalg.norm(t[a, :3] - t[b, :3]) for t in self.truth for a, b in pairs))


class World:
    """Robots (x, y, z, yaw) with first-order velocity lag, a target on a path, and an EKF on hard-edged sensors."""

    def __init__(self, resolved: ResolvedField, starts: Array, path: Array, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.sensors = sensors_from_field(resolved)
        self.parameters = parameters_from_field(resolved)
        self.control = control_from_field(resolved)
        self.safety = safety_from_field(resolved)
        self.names = sorted(resolved.drones)[: len(starts)]
        self.target = next(iter(resolved.tracked))
        self.path = path
        self.x = starts.copy()
        self.v = np.zeros((len(starts), 4))
        layout = StateLayout()
        for name in self.names:
            layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
        self.layout = layout.with_entity(self.target, EntityKind.TARGET, TARGET_CORE)
        self.mean = np.concatenate([starts.ravel(), path[0], np.zeros(2)])
        self.P = np.diag([0.03**2, 0.03**2, 0.04**2, 0.03**2] * len(starts) + [0.1**2] * 2 + [0.2**2] * 2)
        self.last_seen = 0.0
        self.robots_seen = dict.fromkeys(self.names, 0.0)
        self.lookout = Lookout(search_from_field(resolved), self.control, self.sensors, self.names, (self.target,))

    def belief(self, now: float) -> JointBelief:
        return JointBelief(self.mean, self.P, self.layout, round(now * 1e9))

    def sight(self, belief: JointBelief, now: float) -> Sight:
        """Return the tracker's result of the pictures; a target that is given up may be anywhere."""
        age_s = now - self.last_seen
        seen_now = dict.fromkeys(self.names, 0.0)
        if self.lookout.advance(belief, {**seen_now, self.target: age_s}, seen_now):
            t = 4 * len(self.names)
            self.P[t:, :] = self.P[:, t:] = 0.0
            self.P[range(t, t + 4), range(t, t + 4)] = 9.0, 9.0, 0.04, 0.04
        missing = self.lookout.missing
        stands = lambda robots, targets: self.lookout.stands(robots, targets, belief)  # noqa: E731
        unseen_s = {name: now - seen for name, seen in self.robots_seen.items()}
        return Sight(None if missing else age_s, unseen_s, missing=missing, search=stands)

    def velocities(self) -> dict[str, Array]:
        """Return the odometry of each robot's velocity [world]."""
        return {
            n: world_from_stabilized(v[:3], float(x[3])) for n, v, x in zip(self.names, self.v, self.x, strict=True)
        }

    def move(self, commands: Array) -> None:
        """Advance truth by one step, and the belief by odometry with white errors."""
        self.v += (STEP_S / LAG_S) * (commands - self.v)
        noise = self.parameters.noise
        F, Q = np.eye(len(self.mean)), np.zeros(len(self.mean))
        for i, (x, v) in enumerate(zip(self.x, self.v, strict=True)):
            odometry = v + self.rng.normal(0, 1, 4) * np.sqrt(
                np.array([noise.robot_position, noise.robot_position, 1e-4, noise.robot_yaw]) / STEP_S
            )
            for state, velocity, believed in ((x, v, False), (self.mean[4 * i : 4 * i + 4], odometry, True)):
                c, s = math.cos(state[3]), math.sin(state[3])
                step = STEP_S * np.array([c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]])
                if believed:
                    F[4 * i : 4 * i + 2, 4 * i + 3] = E2 @ step
                state += [*step, STEP_S * velocity[2], STEP_S * velocity[3]]
            Q[4 * i : 4 * i + 4] = [noise.robot_position, noise.robot_position, 1e-4, noise.robot_yaw]
        t = 4 * len(self.x)
        F[t, t + 2] = F[t + 1, t + 3] = STEP_S
        Q[t + 2 :] = noise.target_acceleration
        self.mean[t : t + 2] += STEP_S * self.mean[t + 2 :]
        self.P = F @ self.P @ F.T + np.diag(Q * STEP_S)

    def correct(self, H: Array, residual: Array, R: Array) -> None:
        S = H @ self.P @ H.T + np.diag(R)
        K = np.linalg.solve(S, H @ self.P).T
        self.mean += K @ residual
        self.P -= K @ S @ K.T
        self.P = 0.5 * (self.P + self.P.T)

    def look(self, k: int) -> bool:
        """Fuse the observations of the hard-edged sensors; returns whether the target was seen."""
        d, seen = len(self.mean), False
        markers = [self.sensors.marker(n, x, is_robot=True) for n, x in zip(self.names, self.x, strict=True)]
        markers.append(np.array([*self.path[k], self.sensors.marker_height_m[self.target]]))
        for i, name in enumerate(self.names):
            found: list[str] = []
            height = self.x[i, 2:3] + self.rng.normal(0, 0.04)
            self.correct(np.eye(d)[[4 * i + 2]], height - self.mean[4 * i + 2], np.array([0.04**2]))
            for camera, eye in self.sensors.world.items():
                if self.sensors.world_in_view(camera, markers[i]) and self.rng.random() > 0.05:
                    self.robots_seen[name] = k * STEP_S
                    std = eye.noise.position_std_m(float(np.linalg.norm(markers[i] - eye.position_m)))
                    R = np.array([std, std, std, eye.noise.yaw_rad]) ** 2
                    z = self.x[i] + self.rng.normal(0, np.sqrt(R))
                    residual = z - self.mean[4 * i : 4 * i + 4]
                    residual[3] = wrap(float(residual[3]))
                    self.correct(np.eye(d)[4 * i : 4 * i + 4], residual, R)
            for j, marker in enumerate(markers):
                if j == i or not self.sensors.onboard_in_view(name, self.x[i], marker) or self.rng.random() < 0.05:
                    continue
                seen |= j == len(self.names)
                found.append((*self.names, self.target)[j])
                if j < len(self.names):
                    self.robots_seen[self.names[j]] = k * STEP_S
                self.observe(i, j, marker)
            header = Header(round(k * STEP_S * 1e9), "boot", name, f"{name}_camera", k)
            picture = SearchedPicture(header=header, observer=name, camera=f"{name}_camera", found=tuple(found))
            self.lookout.take(picture)
        return seen

    def observe(self, i: int, j: int, marker: Array) -> None:
        """Fuse robot i's observation of entity j: relative (x, y) in its yaw frame, and heading of a robot."""
        eye = self.sensors.onboard[self.names[i]]
        std = eye.noise.position_std_m(float(np.linalg.norm(marker - self.x[i, :3])))
        robot = j < len(self.names)
        R = np.array([std, std, eye.noise.yaw_rad][: 3 if robot else 2]) ** 2

        def relative(own: Array, other: Array) -> Array:
            c, s = math.cos(own[3]), math.sin(own[3])
            xy = np.array([[c, s], [-s, c]]) @ (other[:2] - own[:2])
            return np.array([*xy, other[3] - own[3]]) if robot else xy

        other = self.x[j] if robot else marker
        own, its = self.mean[4 * i : 4 * i + 4], self.mean[4 * j : 4 * j + 4]
        residual = relative(self.x[i], other) + self.rng.normal(0, np.sqrt(R)) - relative(own, its)
        if robot:
            residual[2] = wrap(float(residual[2]))
        c, s = math.cos(own[3]), math.sin(own[3])
        H = np.zeros((len(R), len(self.mean)))
        H[:2, 4 * j : 4 * j + 2] = [[c, s], [-s, c]]
        H[:2, 4 * i : 4 * i + 2] = [[-c, -s], [s, -c]]
        H[:2, 4 * i + 3] = -E2 @ relative(own, its)[:2]
        if robot:
            H[2, 4 * j + 3], H[2, 4 * i + 3] = 1.0, -1.0
        self.correct(H, residual, R)


def fly(world: World, topology: Topology, sight_hz: float = 5.0) -> Trace:
    """Fly along the whole path: control at 50 Hz, plans at 10 Hz that take effect one plan later."""
    planner, trace = Planner(world.parameters, world.sensors), Trace()
    plan: PlanResult | None = None
    coming: PlanResult | None = None
    for k in range(len(world.path)):
        now = k * STEP_S
        belief = world.belief(now)
        if k % 5 == 0:
            plan, topology = coming, coming.topology if coming else topology
            coming = planner.plan(belief, topology, plan.warm_start if plan else None, lambda: False)
        wanted = setpoints_from_plan(plan, belief, world.names, world.control, world.sensors, world.sight(belief, now))
        speeds = world.velocities()
        limited = {n: limit_setpoint(n, wanted[n], belief, belief.stamp_ns, world.safety, speeds) for n in world.names}
        commands = [(*limited[n].setpoint.velocity_m_s, limited[n].setpoint.yaw_rate_rad_s) for n in world.names]
        world.move(np.array(commands))
        seen = world.look(k) if k % round(1 / sight_hz / STEP_S) == 0 else trace.seen[-1]
        if seen:
            world.last_seen = now
        trace.times.append(now)
        trace.truth.append(world.x.copy())
        trace.target.append(world.path[k])
        t = 4 * len(world.names)
        trace.error.append(float(np.hypot(*(world.mean[t : t + 2] - world.path[k]))))
        trace.seen.append(seen)
        trace.topologies.append(str(topology))
        trace.limited.append(tuple(sorted({name for one in limited.values() for name in one.limited_by})))
    return trace


def lab() -> ResolvedField:
    return resolved_field(load_field(CONFIG / "lab.yaml"))


def realistic_path(duration_s: float) -> Array:
    path: dict[str, Any] = load_scenario(CONFIG / "scenarios/realistic.yaml")["target"]["path"]
    return figure_eight(path, duration_s)


def pads(world_height: float) -> Array:
    return np.array([[-0.9, 0.45, world_height, 0.0], [-0.9, -0.45, world_height, 0.0]])


def flight(seed: int, duration_s: float = 70.0, start: str = "flat") -> Trace:
    resolved = lab()
    height = resolved.planner.level_heights_m[0][0]
    world = World(resolved, pads(height), realistic_path(duration_s), seed)
    make = Topology.flat if start == "flat" else Topology.string
    return fly(world, make(world.names))


@pytest.mark.slow
@pytest.mark.study
@pytest.mark.parametrize(("seed", "start"), [(1, "flat"), (1, "string")])
def test_the_figure_eight_is_tracked_by_both_topologies(seed: int, start: str) -> None:
    trace = flight(seed, start=start)
    error, away = np.array(trace.error), np.abs(np.array(trace.target)[:, 0])
    levels = np.array([t.count("/") + 1 for t in trace.topologies])
    assert trace.longest_loss_s() <= 2.0
    assert math.sqrt(float((error**2).mean())) <= 0.15
    assert trace.switches() < 15
    settled = np.array(trace.times) > 5
    assert (levels[settled & (away > 3.0)] == 2).mean() > 0.9, "outside of the ceiling's view one sees the other"
    assert trace.separation_m() >= 0.6
    places, fence = np.array(trace.truth), lab().room.fence
    for axis, (low, high) in enumerate((fence.x_m, fence.y_m, fence.z_m)):
        assert low <= places[:, :, axis].min() and places[:, :, axis].max() <= high


@pytest.mark.slow
@pytest.mark.study
def test_a_target_that_jumps_away_is_found_again() -> None:
    """It took 17 to 60 s, by seed and processor; its limit is judged by kidnap-2m and kidnap-3m."""
    resolved = lab()
    path = realistic_path(110.0)
    path[500:] = path[500:] * np.array([-0.5, 1.0])  # kidnapped after 10 s, to the other side
    world = World(resolved, pads(resolved.planner.level_heights_m[0][0]), path, seed=4)
    trace = fly(world, Topology.flat(world.names))
    late = np.array(trace.error)[-500:]
    assert late.max() < 0.6
    assert all(trace.seen[-100:]) or np.mean(trace.seen[-500:]) > 0.9


def test_drones_that_look_the_wrong_way_search_and_find() -> None:
    resolved = lab()
    starts = pads(resolved.planner.level_heights_m[0][0])
    starts[:, 3] = math.pi
    world = World(resolved, starts, np.tile([1.6, 0.5], (2000, 1)), seed=5)
    world.mean[8:10], world.P[8, 8], world.P[9, 9] = 0.0, 9.0, 9.0
    world.last_seen = -100.0
    trace = fly(world, Topology.flat(world.names))
    first = next(i for i, seen in enumerate(trace.seen) if seen)
    assert trace.times[first] < 25.0
    assert max(trace.error[-250:]) < 0.3

"""Deterministic starts for the local search: the cost has several minima and is flat where nothing is seen."""

import math

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.angles import difference
from groundstation.planning.parameters import PlannerParameters
from groundstation.planning.problem import PlanningScene
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.topology import Topology

Point = tuple[float, float, float]


def starts(
    scene: PlanningScene, topology: Topology, parameters: PlannerParameters, sensors: SensorSuite, scale: Array
) -> list[Array]:
    """Return starts in [-1, 1]^(3 n): stand still, go to the best stand (in the root's view, or not), only turn."""
    found = [np.zeros(scale.size)]
    for keep_root in (True, False):
        poses = _stands(scene, topology, parameters, sensors, keep_root)
        found.append(_controls(scene, poses, parameters.horizon_s, scale))
    turn = found[1].copy().reshape(-1, 3)
    turn[:, :2] = 0.0
    return [*found, turn.ravel()]


def _stands(
    scene: PlanningScene, topology: Topology, parameters: PlannerParameters, sensors: SensorSuite, keep_root: bool
) -> dict[str, tuple[float, float, float]]:
    """Return (x, y, yaw) from which each robot would look at the middle of the level below, from the bottom up."""
    slots = parameters.slots(len(topology.levels)) or ()
    ahead = parameters.horizon_s
    subjects: list[Point] = [
        (float(m[0] + ahead * m[2]), float(m[1] + ahead * m[3]), sensors.marker_height_m[name])
        for name, m in zip(scene.targets, scene.moving, strict=True)
    ]
    index = {name: i for i, name in enumerate(scene.robots)}
    stands: dict[str, tuple[float, float, float]] = {}
    for level in range(len(topology.levels) - 1, -1, -1):
        x, y, z = (sum(values) / len(subjects) for values in zip(*subjects, strict=True))
        height, subjects = slots[level], []
        for name in sorted(topology.levels[level]):
            px, py = _stand(scene.poses[index[name]], (x, y, z), height, name, sensors)
            views = sensors.root_views(height + sensors.marker_height_m[name]) if level == 0 and keep_root else ()
            if views:
                px, py = views[0].shrunk(0.2).nearest(px, py)
            stands[name] = (px, py, math.atan2(y - py, x - px))
            subjects.append((px, py, height + sensors.marker_height_m[name]))
    return stands


def _stand(pose: Array, subject: Point, height: float, name: str, sensors: SensorSuite) -> tuple[float, float]:
    camera = sensors.onboard.get(name)
    tilt = camera.tilt_down_rad if camera else math.pi / 4
    reach = camera.view.range_m if camera else 1.0
    behind = min(max((height - subject[2]) / max(math.tan(tilt), 0.1), 0.4), 0.8 * reach)
    dx, dy = float(pose[0]) - subject[0], float(pose[1]) - subject[1]
    if math.hypot(dx, dy) < 0.1:
        dx, dy = -math.cos(float(pose[3])), -math.sin(float(pose[3]))
    d = math.hypot(dx, dy)
    return subject[0] + behind * dx / d, subject[1] + behind * dy / d


def _controls(
    scene: PlanningScene, stands: dict[str, tuple[float, float, float]], horizon_s: float, scale: Array
) -> Array:
    x = np.zeros(scale.size)
    for i, name in enumerate(scene.robots):
        px, py, yaw = stands[name]
        pose = scene.poses[i]
        rate = max(-1.0, min(1.0, difference(yaw, float(pose[3])) / horizon_s / scale[3 * i + 2]))
        middle = float(pose[3]) + 0.5 * rate * scale[3 * i + 2] * horizon_s
        vx, vy = (px - float(pose[0])) / horizon_s, (py - float(pose[1])) / horizon_s
        c, s = math.cos(middle), math.sin(middle)
        body = np.array([c * vx + s * vy, c * vy - s * vx]) / scale[3 * i : 3 * i + 2]
        x[3 * i : 3 * i + 2] = body / max(1.0, float(np.abs(body).max()))
        x[3 * i + 2] = rate
    return x

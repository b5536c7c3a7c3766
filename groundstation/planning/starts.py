"""Deterministic starts for the local search: the cost has several minima, and is flat where no sensor sees anything."""

import math
from collections.abc import Collection, Sequence

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.angles import difference
from groundstation.planning.detours import Detours
from groundstation.planning.parameters import PlannerParameters
from groundstation.planning.problem import PlanningScene
from groundstation.planning.records import HEIGHT, ROBOT_CONTROLS
from groundstation.sensing.models import Rectangle, SensorSuite
from groundstation.sensing.topology import Topology

Point = tuple[float, float, float]
SMALL_TEAM = 4
"""Up to this many robots, all may start towards other places at once."""

_INSET_M = 0.2  # inside the edge of a world-fixed view


class Starts:
    """Starts in [-1, 1]^(4 n) on one scene; scale: the control that 1 stands for.

    height_m: the height that 0 stands for.
    """

    def __init__(
        self, scene: PlanningScene, parameters: PlannerParameters, sensors: SensorSuite, scale: Array, height_m: float
    ) -> None:
        self._scene, self._parameters, self._sensors = scene, parameters, sensors
        self._height_m = height_m
        self._index = {name: i for i, name in enumerate(scene.robots)}
        # Plain numbers: a large team has thousands of stands in a step, and numpy takes ten times as long for each.
        self._scale: list[float] = scale.tolist()
        self._poses: list[list[float]] = scene.poses.tolist()
        self._views: dict[float, list[Rectangle]] = {}
        self._detours = Detours(sensors.obstacles, parameters.obstacle_m, parameters.fence)
        self._stds_m: list[float] = np.sqrt(np.maximum(scene.prior.diagonal(), 0.0)).tolist()

    def of(self, topology: Topology, known: Array | None, moved: Collection[str]) -> list[Array]:
        """Return starts of a topology: the known optimum of another one, which differs by the robots `moved`.

        Small teams: all stand still, go to the best stand (in the root's view, or not), or only turn. Larger ones:
        moved robots go to their stand, the others continue as before.
        """
        found = [] if known is None else [known]
        if len(self._scene.robots) > SMALL_TEAM:
            base = self.rest(topology) if known is None else known
            return [*found, self._towards(topology, base, moved or self._scene.robots, keep_root=True)]
        rest = self.rest(topology)
        going = [self._towards(topology, rest, self._scene.robots, keep_root) for keep_root in (True, False)]
        turn = going[0].copy().reshape(-1, ROBOT_CONTROLS)
        turn[:, :2] = 0.0
        return [*found, rest, *going, turn.ravel()]

    def rest(self, topology: Topology) -> Array:
        """Return controls with which the robots only go to the heights of their levels."""
        heights = self._parameters.level_heights(len(topology.levels)) or ()
        x = np.zeros((len(self._scene.robots), ROBOT_CONTROLS))
        for name, level in topology.level_by_robot().items():
            x[self._index[name], HEIGHT] = self.height(self._index[name], heights[level])
        return x.ravel()

    def height(self, i: int, height_m: float) -> float:
        """Return a robot's height as a part of a start; one that stays in place keeps its own."""
        height_m = self._poses[i][2] if self._scene.robots[i] in self._scene.held else height_m
        share = (height_m - self._height_m) / self._scale[ROBOT_CONTROLS * i + HEIGHT]
        return max(-1.0, min(1.0, share))

    def _towards(self, topology: Topology, base: Array, robots: Collection[str], keep_root: bool) -> Array:
        """Return controls with which each robot goes to a stand that looks at the middle of the level below."""
        p, sensors, scene = self._parameters, self._sensors, self._scene
        heights, ahead, x = p.level_heights(len(topology.levels)) or (), p.horizon_s, base.copy()
        subjects: list[Point] = [
            (float(m[0] + ahead * m[2]), float(m[1] + ahead * m[3]), sensors.marker_height_m[name])
            for name, m in zip(scene.targets, scene.moving, strict=True)
        ]
        for level in range(len(topology.levels) - 1, -1, -1):
            middle = _middle(subjects)
            height, subjects = heights[level], []
            for name in sorted(topology.levels[level]):
                i, above = self._index[name], height + sensors.marker_height_m[name]
                pose = self._poses[i]
                px, py = pose[0], pose[1]
                if name in robots:
                    px, py = _stand(pose, middle, height, name, sensors)
                    if level == 0 and keep_root:
                        px, py = _in_root_view((px, py), self._root_views(above))
                    self._steer(x, i, (px, py, math.atan2(middle[1] - py, middle[0] - px)))
                    x[ROBOT_CONTROLS * i + HEIGHT] = self.height(i, height)
                subjects.append((px, py, above))
        return x

    def _root_views(self, above_m: float) -> list[Rectangle]:
        """Return the views of world-fixed cameras at a height, without their edge."""
        if above_m not in self._views:
            self._views[above_m] = [view.shrunk(_INSET_M) for view in self._sensors.root_views(above_m)]
        return self._views[above_m]

    def _steer(self, x: Array, i: int, goal: Point) -> None:
        """Write the controls that bring a robot to (x, y, yaw) within the horizon, or as near as possible.

        Past an obstacle it goes to the first corner of its way.
        """
        *end, yaw = goal
        at = ROBOT_CONTROLS * i
        (x_m, y_m, z_m, yaw_rad), horizon_s = self._poses[i], self._parameters.horizon_s
        px, py = self._detours.way((x_m, y_m), (end[0], end[1]), z_m, self._stds_m[i]).next_m
        forward, left, turn = self._scale[at : at + HEIGHT]
        rate = max(-1.0, min(1.0, difference(yaw, yaw_rad) / horizon_s / turn))
        middle = yaw_rad + 0.5 * rate * turn * horizon_s
        vx, vy = (px - x_m) / horizon_s, (py - y_m) / horizon_s
        c, s = math.cos(middle), math.sin(middle)
        ahead, aside = (c * vx + s * vy) / forward, (c * vy - s * vx) / left
        over = max(1.0, abs(ahead), abs(aside))
        x[at], x[at + 1], x[at + 2] = ahead / over, aside / over, rate


def _middle(points: Sequence[Point]) -> Point:
    """Return the mean of points."""
    x, y, z = (sum(part) / len(points) for part in zip(*points, strict=True))
    return x, y, z


def _in_root_view(stand: tuple[float, float], views: Sequence[Rectangle]) -> tuple[float, float]:
    """Return the point in a world-fixed view that is nearest to a stand; the stand itself without a view."""
    points = (view.nearest(*stand) for view in views)
    return min(points, key=lambda point: math.dist(point, stand), default=stand)


def _stand(
    pose: Sequence[float], subject: Point, height: float, name: str, sensors: SensorSuite
) -> tuple[float, float]:
    camera = sensors.onboard.get(name)
    tilt = camera.tilt_down_rad if camera else math.pi / 4
    reach = camera.view.range_m if camera else 1.0
    behind = min(max((height - subject[2]) / max(math.tan(tilt), 0.1), 0.4), 0.8 * reach)
    dx, dy = pose[0] - subject[0], pose[1] - subject[1]
    if math.hypot(dx, dy) < 0.1:
        dx, dy = -math.cos(pose[3]), -math.sin(pose[3])
    d = math.hypot(dx, dy)
    return subject[0] + behind * dx / d, subject[1] + behind * dy / d

"""Finds stands inside the fence that see a place, and chains of drones down from a fixed camera."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from groundstation.arrays import Array
from groundstation.forecast.team import Place, Team
from groundstation.sensing.detection import FOUND_SHARE, detection
from groundstation.sensing.models import OnboardCameraModel, WorldCameraModel
from groundstation.sensing.occlusion import SOFT_M, box_rows, sight
from groundstation.sensing.visibility import camera_rows

Point = tuple[float, float, float]

_BEARINGS, _DISTANCES, _NEAREST_M = 12, 5, 0.3
_TRIED = 6  # stands of a drone above which another drone is tried
_NOWHERE = np.zeros(4)


class Obstruction(IntEnum):
    """Causes of an unseen place, in the order of their checks."""

    NO_CAMERA = 0
    OUT_OF_SIGHT = 1
    OUT_OF_FENCE = 2
    HIDDEN = 3
    NOBODY_PLACES = 4


@dataclass(frozen=True, slots=True)
class Link:
    """A drone of a chain at its stand: pose (x, y, z, yaw) [m, rad; world]."""

    robot: str
    pose: Array


Chain = tuple[Link, ...]
"""Drones from the one that sees the place up to the one that a fixed camera sees; none: the fixed camera sees it."""


class Views:
    """The views of a team's cameras, with the hard limits of a full search of a picture."""

    def __init__(self, team: Team) -> None:
        self._team = team
        models: dict[str, WorldCameraModel | OnboardCameraModel] = {**team.sensors.world, **team.sensors.onboard}
        rows = camera_rows(list(models.values()), team.sensors.softness)
        self._rows = dict(zip(models, rows, strict=True))
        self._boxes = box_rows(team.sensors.obstacles)
        low, high = team.planner.heights_m
        self._heights = sorted({low, *(row[-1] for row in team.planner.level_heights_m), high})
        self._bearings = np.arange(_BEARINGS) * math.tau / _BEARINGS
        self._reaches: dict[tuple[str, float], list[tuple[float, float]]] = {}

    def sees(self, camera: str, pose: Array, point: Point) -> float:
        """Return the probability that a camera shows a marker at a point [m; world]; pose: of its robot."""
        share = detection(self._rows[camera], pose, 0.0, *point) / FOUND_SHARE
        if share < 0.5 or not len(self._boxes):
            return share if share >= 0.5 else 0.0
        x, y, z = self._team.sensors.eye(camera, pose).tolist()
        free = sight(self._boxes, SOFT_M, x, y, z, *point).a
        return share * free if free >= 0.5 else 0.0

    def placed_by(self, point: Point, is_target: bool) -> float:
        """Return the probability that a fixed sensor, the best one, locates a marker at a point."""
        world = self._team.sensors.world
        return max(
            (self._places(name, point) for name, one in world.items() if one.observes_targets or not is_target),
            default=0.0,
        )

    def _places(self, sensor: str, point: Point) -> float:
        seen, ranges = self.sees(sensor, _NOWHERE, point), self._team.ranging.get(sensor)
        return seen if seen <= 0.0 or ranges is None or ranges.tells(point) else 0.0

    def is_placed_above(self, robot: str, place: Place) -> bool:
        """Return whether a fixed camera sees a robot's marker at one of its heights above a place inside the fence."""
        (x0, x1), (y0, y1) = self._team.planner.fence.x_m, self._team.planner.fence.y_m
        return (x0 <= place[0] <= x1 and y0 <= place[1] <= y1) and any(
            self.placed_by(self.marker(robot, np.array([*place, height, 0.0])), is_target=False)
            for height in self._heights
        )

    def marker(self, robot: str, pose: Array) -> Point:
        """Return the place of a robot's marker."""
        return float(pose[0]), float(pose[1]), float(pose[2]) + self._team.sensors.marker_height_m[robot]

    def placed(self, poses: Mapping[str, Array], place: Place) -> frozenset[str]:
        """Return the robots, and the target, that fixed cameras see directly or through robots in their view."""
        team = self._team
        points = {name: self.marker(name, pose) for name, pose in poses.items()} | {team.target: self.ground(place)}
        found = {name for name, point in points.items() if self.placed_by(point, name == team.target)}
        fresh = found & poses.keys()
        while fresh:
            seen = {
                name
                for name, point in points.items()
                if name not in found
                and any(one in team.sensors.onboard and self.sees(one, poses[one], point) for one in fresh)
            }
            found |= seen
            fresh = seen & poses.keys()
        return frozenset(found)

    def ground(self, place: Place) -> Point:
        """Return the place of the target's marker when it stands at a place."""
        return (*place, self._team.sensors.marker_height_m[self._team.target])

    def chain_to(self, place: Place) -> Chain | Obstruction:
        """Return the shortest chain found that shows the target at a place, or the obstruction."""
        point = self.ground(place)
        if self.placed_by(point, is_target=True):
            return ()
        worst = Obstruction.NO_CAMERA
        for links in range(1, len(self._team.planner.level_heights_m) + 1):
            found = self._chain(point, self._team.robots, links)
            if not isinstance(found, Obstruction):
                return found
            worst = max(worst, found)
        return worst

    def why_unplaced(self, place: Place) -> str:
        """Return why no fixed camera sees a drone at the stand for a place that is nearest to the room's middle."""
        world, (mx, my) = self._team.sensors.world, self._team.planner.fence.center
        stands = [
            self.marker(robot, pose)
            for robot in self._team.robots
            if not isinstance(found := self._stands(robot, self.ground(place)), Obstruction)
            for _, pose in found
        ]
        point = min(stands, key=lambda one: math.hypot(one[0] - mx, one[1] - my))
        missed: dict[str, list[str]] = {}
        for name in world:
            missed.setdefault(self._miss(name, point), []).append(name)
        return " and ".join(f"{how} {', '.join(names)}" for how, names in missed.items())

    def _miss(self, camera: str, point: Point) -> str:
        model = self._team.sensors.world[camera]
        if math.dist(model.position_m, point) > model.view.range_m:
            return "beyond the range of"
        if not self._team.sensors.world_in_view(camera, np.array(point)):
            return "out of the view of"
        return "not told in x and y by the ranges of" if camera in self._team.ranging else "hidden from"

    def _chain(self, point: Point, robots: Sequence[str], links: int) -> Chain | Obstruction:
        worst, stands = Obstruction.NO_CAMERA, []
        for robot in robots:
            found = self._stands(robot, point)
            if isinstance(found, Obstruction):
                worst = max(worst, found)
            else:
                stands += [(sure, Link(robot, pose)) for sure, pose in found]
        if not stands:
            return worst
        if links == 1:
            rooted = [(sure * self.placed_by(self.marker(one.robot, one.pose), False), one) for sure, one in stands]
            best = max(rooted, key=lambda entry: entry[0])
            return (best[1],) if best[0] > 0.0 else Obstruction.NOBODY_PLACES
        return self._longer([one for _, one in stands], robots, links)

    def _longer(self, stands: Sequence[Link], robots: Sequence[str], links: int) -> Chain | Obstruction:
        """Return a chain from one of the stands nearest to the middle of the fence."""
        x, y = self._team.planner.fence.center
        inwards = sorted(stands, key=lambda one: math.hypot(one.pose[0] - x, one.pose[1] - y))
        for one in inwards[:_TRIED]:
            above = self._chain(self.marker(one.robot, one.pose), [r for r in robots if r != one.robot], links - 1)
            if not isinstance(above, Obstruction):
                return (one, *above)
        return Obstruction.NOBODY_PLACES

    def _stands(self, robot: str, point: Point) -> list[tuple[float, Array]] | Obstruction:
        """Return the places where a robot may hover and sees a point, with probabilities."""
        camera, fence = self._team.sensors.onboard.get(robot), self._team.planner.fence
        if camera is None:
            return Obstruction.NO_CAMERA
        reaches = self._reach(robot, camera, point[2])
        if not reaches:
            return Obstruction.OUT_OF_SIGHT
        (x0, x1), (y0, y1) = fence.x_m, fence.y_m
        inside = [
            np.array([x, y, height, bearing - camera.pan_left_rad])
            for distance, height in reaches
            for bearing in self._bearings.tolist()
            if x0 <= (x := point[0] - distance * math.cos(bearing)) <= x1
            and y0 <= (y := point[1] - distance * math.sin(bearing)) <= y1
        ]
        if not inside:
            return Obstruction.OUT_OF_FENCE
        free = np.array(inside)
        for box in self._team.sensors.obstacles:
            free = free[box.distances_m(free[:, :3]) >= self._team.planner.obstacle_m]
        seeing = [(sure, pose) for pose in free if (sure := self.sees(robot, pose, point)) > 0.0]
        return seeing or Obstruction.HIDDEN

    def in_box(self, place: Place, height_m: float = 0.0) -> bool:
        """Return whether a point lies in an obstacle of the room."""
        return any(
            abs(place[0] - box.centre_m[0]) <= box.size_m[0] / 2
            and abs(place[1] - box.centre_m[1]) <= box.size_m[1] / 2
            and height_m <= box.size_m[2]
            for box in self._team.sensors.obstacles
        )

    def _reach(self, robot: str, camera: OnboardCameraModel, marker_m: float) -> list[tuple[float, float]]:
        """Return distances and heights from which a camera turned to a marker shows it."""
        key = robot, round(marker_m, 3)
        if key not in self._reaches:
            self._reaches[key] = [
                (distance, height)
                for height in self._heights
                for distance in np.linspace(_NEAREST_M, camera.view.range_m, _DISTANCES).tolist()
                if detection(
                    self._rows[robot],
                    np.array([-distance, 0.0, height, -camera.pan_left_rad]), 0.0, 0.0, 0.0, marker_m,
                ) >= 0.5 * FOUND_SHARE
            ]  # fmt: skip
        return self._reaches[key]

"""The models of cameras: mounting, view, and noise of measurements."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.rotations import base_from_tilted_optical, rotation_z
from groundstation.sensing.cross_section import shown_rectangle

OPTICAL_FROM_WORLD_LOOKING_DOWN: Array = np.diag([1.0, -1.0, -1.0])
OPTICAL_FROM_WORLD_LOOKING_DOWN.setflags(write=False)

STEEPEST_COS = math.cos(math.radians(70.0))
"""A flat marker is found up to this angle between its normal and the line of sight (docs/reference/vision.md 2)."""


@dataclass(frozen=True, slots=True)
class Frustum:
    """A view pyramid: tangents of its half angles, range, and border within which no marker counts as seen.

    border_m: a marker's centre must be this far inside the side planes (half the board's diagonal).
    """

    half_width_tan: float
    half_height_tan: float
    range_m: float
    border_m: float = 0.15

    @classmethod
    def of_picture(
        cls, width_px: int, height_px: int, fx_px: float, fy_px: float, range_m: float, border_m: float = 0.15
    ) -> "Frustum":
        """Return the frustum of a pinhole with its principal point in the middle."""
        return cls(width_px / (2 * fx_px), height_px / (2 * fy_px), range_m, border_m)

    def margin(self, point: Array) -> float:
        """Return the least signed distance to the planes and the range limit [m; camera optical]; >= 0 is in view."""
        x, y, z = (float(value) for value in point)
        across, along = self.half_width_tan, self.half_height_tan
        side = (z * across - abs(x)) / math.hypot(1.0, across) - self.border_m
        edge = (z * along - abs(y)) / math.hypot(1.0, along) - self.border_m
        return min(side, edge, self.range_m - math.hypot(x, y, z))


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviation of a relative position: hypot(base_m, per_m d, per_m2 d^2), isotropic; and of a heading.

    It is for planning: a real sighting has a covariance of its own (drivers/camera/pose.py).
    """

    base_m: float = 0.02
    per_m: float = 0.0175
    per_m2: float = 0.004
    yaw_rad: float = 0.05

    def position_std_m(self, distance_m: float) -> float:
        """Return the standard deviation per axis at a distance [m]."""
        return math.hypot(self.base_m, self.per_m * distance_m, self.per_m2 * distance_m**2)


@dataclass(frozen=True, slots=True)
class Softness:
    """Shape of the smooth availability: docs/explanation/planning.md 3.

    caution: number of standard deviations of a relative place by which the view's limits are moved inwards.
    """

    width_m: float = 0.08
    tail_share: float = 2e-3
    tail_m: float = 1.0
    caution: float = 1.5


@dataclass(frozen=True, slots=True)
class WorldCameraModel:
    """A camera fixed in the world: position [m; world], optical_from_world (3, 3), its view and its noise."""

    position_m: tuple[float, float, float]
    view: Frustum
    noise: Noise = Noise(0.02, 0.004, 0.0, 0.035)
    optical_from_world: Array = field(default_factory=lambda: OPTICAL_FROM_WORLD_LOOKING_DOWN, compare=False)
    observes_targets: bool = False

    def optical(self, point: Array) -> Array:
        """Return a world point in the camera's optical frame."""
        return np.asarray(self.optical_from_world @ (point - np.array(self.position_m)))


@dataclass(frozen=True, slots=True)
class OnboardCameraModel:
    """A robot's forward camera: position [m; base], tilted down and panned left, its view and its noise."""

    position_m: tuple[float, float, float]
    view: Frustum
    tilt_down_rad: float = math.radians(45)
    pan_left_rad: float = 0.0
    noise: Noise = Noise()

    @property
    def optical_from_base(self) -> Array:
        """Return the rotation (3, 3) from base_stabilized to the optical frame."""
        return base_from_tilted_optical(self.tilt_down_rad, self.pan_left_rad).T

    def optical(self, robot: Array, point: Array) -> Array:
        """Return a world point in the optical frame of the camera of a level robot at (x, y, z, yaw)."""
        relative = rotation_z(float(robot[3])).T @ (point - robot[:3])
        return np.asarray(self.optical_from_base @ (relative - np.array(self.position_m)))


@dataclass(frozen=True, slots=True)
class Rectangle:
    """An axis-parallel rectangle of the floor plan [m; world]."""

    x_m: tuple[float, float]
    y_m: tuple[float, float]

    @property
    def center(self) -> tuple[float, float]:
        """Return the middle."""
        return (sum(self.x_m) / 2, sum(self.y_m) / 2)

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Return the four corners."""
        return tuple((x, y) for x in self.x_m for y in self.y_m)

    def shrunk(self, by_m: float) -> "Rectangle":
        """Return the rectangle with each side moved inwards, at most to the middle."""
        (x0, x1), (y0, y1) = self.x_m, self.y_m
        dx, dy = min(by_m, (x1 - x0) / 2), min(by_m, (y1 - y0) / 2)
        return Rectangle((x0 + dx, x1 - dx), (y0 + dy, y1 - dy))

    def grown(self, by_m: float) -> "Rectangle":
        """Return the rectangle with each side moved outwards."""
        (x0, x1), (y0, y1) = self.x_m, self.y_m
        return Rectangle((x0 - by_m, x1 + by_m), (y0 - by_m, y1 + by_m))

    def depth_m(self, x: float, y: float) -> float:
        """Return how far inside its nearest side a point lies [m; negative: outside of the farthest one]."""
        return min(x - self.x_m[0], self.x_m[1] - x, y - self.y_m[0], self.y_m[1] - y)

    def span(self, place: tuple[float, float], way: tuple[float, float]) -> tuple[float, float]:
        """Return where a line along a unit vector enters and leaves it [m from place]; missed: the first is larger."""
        first, last = -math.inf, math.inf
        for at, along, (low, high) in zip(place, way, (self.x_m, self.y_m), strict=True):
            if abs(along) < 1e-9:
                first, last = (first, last) if low <= at <= high else (math.inf, -math.inf)
                continue
            ends = sorted(((low - at) / along, (high - at) / along))
            first, last = max(first, ends[0]), min(last, ends[1])
        return first, last

    def nearest(self, x: float, y: float) -> tuple[float, float]:
        """Return the point of the rectangle that is closest to a point."""
        return min(max(x, self.x_m[0]), self.x_m[1]), min(max(y, self.y_m[0]), self.y_m[1])


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box that stands on the floor along the room's axes, and hides what is behind it [m; world]."""

    centre_m: tuple[float, float]
    size_m: tuple[float, float, float]

    @property
    def middle_m(self) -> tuple[float, float, float]:
        """Return its middle."""
        return (*self.centre_m, self.size_m[2] / 2.0)

    @property
    def outline(self) -> Rectangle:
        """Return what it covers of the floor plan."""
        (x, y), (length, width, _) = self.centre_m, self.size_m
        return Rectangle((x - length / 2, x + length / 2), (y - width / 2, y + width / 2))

    def distances_m(self, places: Array) -> Array:
        """Return how far places (n, 3) [m; world] are from it (n) [m]; 0 inside."""
        outside = np.abs(places - self.middle_m) - 0.5 * np.array(self.size_m)
        return np.asarray(np.linalg.norm(np.maximum(outside, 0.0), axis=1))


SIGHTINGS_PER_S = 12.0
"""Rate of sightings of a marker in view that plans assume."""


@dataclass(frozen=True, slots=True)
class SensorSuite:
    """All cameras and marker heights of the team, and the boxes known to hide markers.

    marker_height_m: of robots above their centre, of targets above the floor. sightings_per_s: of a marker in view.
    """

    world: Mapping[str, WorldCameraModel]
    onboard: Mapping[str, OnboardCameraModel]
    marker_height_m: Mapping[str, float]
    softness: Softness = Softness()
    sightings_per_s: float = SIGHTINGS_PER_S
    obstacles: tuple[Box, ...] = ()

    def marker(self, name: str, mean: Array, is_robot: bool) -> Array:
        """Return the centre of an entity's marker [m; world] from its part of the belief's mean."""
        height = self.marker_height_m[name] + (float(mean[2]) if is_robot else 0.0)
        return np.array([mean[0], mean[1], height])

    def eye(self, camera: str, mean: Array) -> Array:
        """Return a camera's place [m; world]; mean: x, y, z, yaw of its carrier, unused for a fixed one."""
        if camera in self.world:
            return np.array(self.world[camera].position_m)
        return np.asarray(mean[:3] + rotation_z(float(mean[3])) @ np.array(self.onboard[camera].position_m))

    def world_in_view(self, camera: str, point: Array) -> bool:
        """Return whether a world-fixed camera has a marker at a world point in view (hard limits)."""
        eye = self.world[camera]
        return eye.view.margin(eye.optical(point)) >= 0

    def onboard_in_view(self, robot: str, mean: Array, point: Array) -> bool:
        """Return whether a robot at (x, y, z, yaw) has a marker at a world point in view (hard limits)."""
        eye = self.onboard[robot]
        return eye.view.margin(eye.optical(mean, point)) >= 0

    def root_views(self, height_m: float) -> tuple[Rectangle, ...]:
        """Return the rectangles in which world-fixed cameras reliably see a marker at this height, from above.

        The whole of each rectangle is in view and within the camera's range, however the camera is tilted and turned.
        """
        found = []
        for camera in self.world.values():
            (x, y, z), view = camera.position_m, camera.view
            sides = shown_rectangle(
                tuple(tuple(row) for row in camera.optical_from_world.tolist()),
                (view.half_width_tan, view.half_height_tan),
                view.border_m,
                min(view.range_m, (z - height_m) / STEEPEST_COS),
                z - height_m,
            )
            if sides is not None:
                (west, east), (south, north) = sides
                found.append(Rectangle((x + west, x + east), (y + south, y + north)))
        return tuple(found)

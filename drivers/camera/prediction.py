"""Predicts where markers are in a picture, from the belief about all entities, the camera's pose and both attitudes."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from drivers.camera import convert
from drivers.camera.detect import Window, window_around
from drivers.camera.pose import LEVEL_STD_RAD
from drivers.camera.settings import MarkerKind, MarkerSettings, MountSettings
from groundstation.arrays import Array
from groundstation.bus.messages import EntityEstimate, Estimate
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import rotation_from_euler, rotation_z
from groundstation.time_units import NS_PER_MS

Attitude = tuple[float, float]

# Estimates come at 50 Hz; a picture is exposed up to 2.5 s before it is processed.
_KEPT = 128
_FARTHEST_NS = 300 * NS_PER_MS
# A target that no camera has seen for this long is sought by all; after the longer time the tracker decides that.
_SOUGHT_AFTER_S, _SOUGHT_FOR_S = 0.5, 10.0
# Errors of roll, pitch and mounting: of an observer that measures its attitude, and of a mount.
_ATTITUDE_STD_RAD, _MOUNT_STD_RAD = math.radians(2.0), math.radians(0.5)
_FLOOR_STD_M = 0.02
_SIGMAS = 2.5
_SLACK_PX = 4.0
_LEAST_DEPTH_M = 0.15
# Seen flatter than this (85 degrees from face on), a board is turned away for certain.
_LEAST_FACING = 0.087
_WIDEST_SHARE = 0.2
# From the centre of a checkerboard to its outer corners.
_RADIUS_SQUARES = 1.803
_MARGIN_SQUARES = 1.6
# A marker that does not show where the belief expects it is looked for in this many pictures, then in every third.
_EAGER_LOOKS, _PATIENT_STRIDE = 4, 3


@dataclass(frozen=True, slots=True)
class Prediction:
    """Where the corners of a marker should be: a circle [px], its uncertainty (one sigma, px), the side of a square."""

    centre: Array
    radius_px: float
    spacing_px: float
    std_px: float

    @property
    def reach_px(self) -> float:
        """Return the radius of the search about its centre [px], wide enough for the uncertainty."""
        return self.radius_px + _MARGIN_SQUARES * self.spacing_px + _SIGMAS * self.std_px + _SLACK_PX

    def is_at(self, centre: Array) -> bool:
        """Return whether a marker with this centre [px] is where it is expected."""
        return float(np.hypot(*(centre - self.centre))) < self.radius_px + self.std_px

    def window(self, shape: tuple[int, ...]) -> Window | None:
        """Return the window to look in; None if it is outside of the picture."""
        return window_around(self.centre[None], self.reach_px, shape)


def is_looked_for(missing: int) -> bool:
    """Return whether a marker is looked for where the belief has it; missing: number of pictures without it."""
    return missing <= _EAGER_LOOKS or missing % _PATIENT_STRIDE == 0


# None: certainly not in the picture. Entities without a useful belief are absent.
Predictions = dict[str, Prediction | None]


class Foresight:
    """The newest estimates, and their predictions for one camera; pure values."""

    def __init__(
        self, mount: MountSettings, observer: str, markers: tuple[MarkerSettings, ...], intrinsics: CameraIntrinsics
    ) -> None:
        self._mount, self._observer, self._intrinsics = mount, observer, intrinsics
        self._markers = [(marker, marker.reach_m) for marker in markers]
        self._estimates: deque[Estimate] = deque(maxlen=_KEPT)

    def add(self, estimate: Estimate) -> None:
        """Remember an estimate; one that is older than the newest is ignored."""
        if not self._estimates or estimate.header.stamp_ns > self._estimates[-1].header.stamp_ns:
            self._estimates.append(estimate)

    def at(self, stamp_ns: int, attitude: Attitude | None) -> Predictions:
        """Return where each marker should be in a picture with that exposure.

        attitude: of the observer, if measured.
        """
        estimate = self._nearest(stamp_ns)
        if estimate is None:
            return {}
        seconds = (stamp_ns - estimate.header.stamp_ns) / 1e9
        entities = {entity.name: entity for entity in estimate.entities}
        camera = self._camera(entities.get(self._observer), seconds, attitude)
        if camera is None:
            return {}
        found: Predictions = {}
        for marker, reach_m in self._markers:
            entity = entities.get(marker.entity)
            place = _marker_place(entity, marker, seconds) if entity is not None else None
            if place is not None:
                known, prediction = _seen(camera, *place, reach_m, self._intrinsics)
                if known:
                    found[marker.entity] = prediction
        return found

    def sought(self, stamp_ns: int, predictions: Predictions) -> frozenset[str]:
        """Return the entities for which whole pictures are searched often unless they are in view.

        These are targets that no camera saw at the exposure: the tracker searches for them, or has just lost them. For
        a world-fixed camera they are also the robots that `predictions` have in its picture: if it misses one
        repeatedly, the tracker learns that the robot's estimate is wrong.
        """
        estimate = self._nearest(stamp_ns)
        if estimate is None:
            return frozenset()
        targets = {marker.entity for marker, _ in self._markers if marker.kind is MarkerKind.TARGET}
        unseen = {one.name for one in estimate.entities if _SOUGHT_AFTER_S < one.age_s <= _SOUGHT_FOR_S}
        missed = {name for name, prediction in predictions.items() if prediction is not None}
        wanted = targets & (unseen | {search.target for search in estimate.searches})
        return frozenset(wanted | (missed - targets if self._mount.in_world else set()))

    def _nearest(self, stamp_ns: int) -> Estimate | None:
        """Return the estimate nearest to an exposure, or None if all are long before or after."""
        nearest, least_ns = None, _FARTHEST_NS
        for estimate in reversed(self._estimates):  # the newest first: their stamps rise, and exposures are recent
            away_ns = abs(estimate.header.stamp_ns - stamp_ns)
            if away_ns <= least_ns:
                nearest, least_ns = estimate, away_ns
            elif nearest is not None:
                break
        return nearest

    def _camera(self, carrier: EntityEstimate | None, seconds: float, attitude: Attitude | None) -> "_Camera | None":
        position = np.array(self._mount.position_m)
        optical = convert.parent_from_optical(self._mount)
        if self._mount.in_world:
            return _Camera(Pose(optical, position), np.zeros((3, 3)), _MOUNT_STD_RAD, _MOUNT_STD_RAD**2)
        if carrier is None or len(carrier.mean) != 4:
            return None
        covariance = np.array(carrier.covariance).reshape(4, 4)
        base = rotation_from_euler(*(attitude or (0.0, 0.0)), carrier.mean[3])
        centre = np.array(carrier.mean[:3]) + seconds * np.array(carrier.velocity_m_s)
        tilt = _ATTITUDE_STD_RAD if attitude is not None else LEVEL_STD_RAD
        return _Camera(Pose(base @ optical, centre + base @ position), covariance[:3, :3], tilt, covariance[3, 3])


@dataclass(frozen=True, slots=True)
class _Camera:
    """world_from_optical; covariance of its position [m^2], std of its tilt [rad], variance of its heading [rad^2]."""

    pose: Pose
    covariance: Array
    tilt_std_rad: float
    yaw_variance: float

    def covariance_of(self, point: Array) -> Array:
        """Return the covariance (3, 3) [m^2; world] of a world point relative to the camera, from the camera alone."""
        x, y, z = (point - self.pose.translation).tolist()
        # Tilts displace it by (0, -z, y) and (z, 0, -x), a turn by (-y, x, 0).
        tilt, yaw = self.tilt_std_rad**2, self.yaw_variance
        xy, xz, yz = -yaw * x * y, -tilt * x * z, -tilt * y * z
        xx, yy, zz = tilt * z * z + yaw * y * y, tilt * z * z + yaw * x * x, tilt * (x * x + y * y)
        return np.asarray(self.covariance + np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def _marker_place(entity: EntityEstimate, marker: MarkerSettings, seconds: float) -> tuple[Array, Array] | None:
    """Return a marker's centre [m; world] and its covariance (3, 3)."""
    mean, size = np.array(entity.mean), len(entity.mean)
    covariance = np.array(entity.covariance).reshape(size, size)
    offset = np.array(marker.position_m)
    if marker.kind is MarkerKind.TARGET:
        full = np.diag([0.0, 0.0, _FLOOR_STD_M**2])
        full[:2, :2] = covariance[:2, :2]
        along = np.append(np.array(entity.velocity_m_s)[:2], 0.0)
        # Its heading is unknown, so the marker's offset from its centre is uncertainty.
        full[:2, :2] += np.eye(2) * float(offset[:2] @ offset[:2])
        return np.append(mean[:2], 0.0) + seconds * along + (0.0, 0.0, offset[2]), full
    if size != 4:
        return None
    centre = mean[:3] + seconds * np.array(entity.velocity_m_s) + rotation_z(float(mean[3])) @ offset
    return centre, covariance[:3, :3]


def _seen(
    camera: _Camera, centre: Array, covariance: Array, reach_m: float, intrinsics: CameraIntrinsics
) -> tuple[bool, Prediction | None]:
    """Return whether a prediction is possible, and where the marker is seen (None: certainly nowhere)."""
    rotation = camera.pose.rotation
    point = camera.pose.inverse().apply(centre)
    relative = rotation.T @ (covariance + camera.covariance_of(centre)) @ rotation
    depth_std = math.sqrt(relative[2, 2])
    height = -float(rotation[2] @ point)
    height_std = _SIGMAS * math.sqrt(float(rotation[2] @ relative @ rotation[2]))
    if height + height_std < _LEAST_FACING * float(np.linalg.norm(point)):
        return True, None
    if point[2] < _LEAST_DEPTH_M + _SIGMAS * depth_std:
        return point[2] < -_SIGMAS * depth_std, None
    jacobian = intrinsics.project_jacobian(point)
    (a, b), (_, d) = (jacobian @ relative @ jacobian.T).tolist()
    std_px = math.sqrt(0.5 * (a + d) + math.hypot(0.5 * (a - d), b))  # along the longer axis of its ellipse
    if std_px > _WIDEST_SHARE * intrinsics.width_px:
        return False, None
    pixel = intrinsics.pixel(*point.tolist())
    if pixel is None:
        return True, None
    centre_px = np.array(pixel)
    if not intrinsics.contains(centre_px, -_SIGMAS * std_px):
        return True, None
    # The marker is level; its heading does not change its largest and least extent.
    most, least = _singular_values(jacobian @ rotation[:2].T)
    return True, Prediction(centre_px, most * reach_m, least * reach_m / _RADIUS_SQUARES, std_px)


def _singular_values(matrix: Array) -> tuple[float, float]:
    """Return the larger and the smaller singular value of a matrix (2, 2): a turn and a mirroring add up to it."""
    (a, b), (c, d) = matrix.tolist()
    turn, mirroring = 0.5 * math.hypot(a + d, b - c), 0.5 * math.hypot(a - d, b + c)
    return turn + mirroring, abs(turn - mirroring)

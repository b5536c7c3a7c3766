"""The relative pose from twelve corners: both planar solutions, choice by gravity, covariance from the Jacobian."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.angles import difference
from groundstation.geometry.lens import CameraIntrinsics

LEVEL_STD_RAD = math.radians(8.0)
"""By how much roll and pitch may err that are unknown and assumed to be level."""
# By how much the measured roll and pitch of both vehicles may err together.
_GRAVITY_STD_RAD = math.radians(3.0)
_REFINE = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 1e-9)


@dataclass(frozen=True, slots=True)
class PlanarPose:
    """optical_from_marker of one solution, with the sum of squared reprojection errors [px^2]."""

    rotation: Array
    translation: Array
    squared_error: float


@dataclass(frozen=True, slots=True)
class Gravity:
    """The known direction of "down": stabilized_from_optical (3, 3) of the observer, the subject's roll and pitch.

    For a world-fixed camera the stabilized frame is the world. known: both attitudes were measured, not assumed level.
    """

    stabilized_from_optical: Array
    subject_roll_rad: float
    subject_pitch_rad: float
    known: bool


@dataclass(frozen=True, slots=True)
class RelativePose:
    """Marker position [m; camera_optical], yaw in the observer's stabilized frame, covariance (4, 4) of both."""

    position_m: Array
    yaw_rad: float
    covariance: Array


@dataclass(frozen=True, slots=True)
class PoseChoice:
    """The pose that gravity prefers; the other one if not ruled out; residual rms per corner [px]."""

    best: RelativePose
    alternative: RelativePose | None
    residual_px: float


def planar_poses(
    corners: Array, points: Array, intrinsics: CameraIntrinsics, rays: Array | None = None
) -> list[PlanarPose]:
    """Return the one or two poses of a flat board (points (n, 3) [m; marker]), refined on the distorted pixels.

    rays: of the corners, normalised (n, 2), if the caller has them.
    """
    if rays is None:
        rays = intrinsics.normalised_from_pixels(corners)
    if not np.isfinite(rays).all():
        return []
    count, turns, shifts, _ = cv2.solvePnPGeneric(
        points, rays.reshape(-1, 1, 2), np.eye(3), None, flags=cv2.SOLVEPNP_IPPE
    )
    poses = []
    for turn, shift in zip(turns[:count], shifts[:count], strict=True):
        pose = _refined(corners, points, intrinsics, np.asarray(turn), np.asarray(shift))
        if pose is not None:
            poses.append(pose)
    return poses


def _refined(
    corners: Array, points: Array, intrinsics: CameraIntrinsics, turn: Array, shift: Array
) -> PlanarPose | None:
    turned, shifted = cv2.solvePnPRefineLM(
        points,
        corners.reshape(-1, 1, 2),
        intrinsics.matrix,
        np.array(intrinsics.distortion),
        turn.reshape(3, 1),
        shift.reshape(3, 1),
        _REFINE,
    )
    rotation = np.asarray(cv2.Rodrigues(turned)[0], dtype=np.float64)
    translation = np.asarray(shifted, dtype=np.float64).ravel()
    errors = intrinsics.project(points @ rotation.T + translation) - corners
    if not np.isfinite(errors).all() or translation[2] <= 0.0:
        return None
    return PlanarPose(rotation, translation, float((errors**2).sum()))


def choose(
    poses: list[PlanarPose],
    points: Array,
    intrinsics: CameraIntrinsics,
    gravity: Gravity,
    floor_px: float,
    ambiguity_cost: float,
) -> PoseChoice:
    """Return the pose that fits corners and gravity best; keeps the other one if neither rules it out.

    floor_px: least standard deviation assumed of a corner. Costs are in chi-square units.
    """
    freedom = 2 * len(points) - 6
    variance = min(pose.squared_error for pose in poses) / freedom + floor_px**2
    ranked = sorted(((_cost(pose, variance, gravity), pose) for pose in poses), key=lambda pair: pair[0])
    first_cost, first = ranked[0]
    best = relative_pose(first, points, intrinsics, gravity, floor_px)
    residual = math.sqrt(first.squared_error / freedom)
    if len(ranked) == 1 or ranked[1][0] - first_cost >= ambiguity_cost:
        return PoseChoice(best, None, residual)
    other = relative_pose(ranked[1][1], points, intrinsics, gravity, floor_px)
    return PoseChoice(best, other if _differ(best, other) else None, residual)


def _cost(pose: PlanarPose, variance: float, gravity: Gravity) -> float:
    (xx, _, xz), (yx, _, yz), (_, _, zz) = (gravity.stabilized_from_optical @ pose.rotation).tolist()
    yaw, roll, pitch = math.atan2(yx, xx), gravity.subject_roll_rad, gravity.subject_pitch_rad
    # The subject's z axis by its roll, its pitch and that yaw.
    ahead, left, up = math.sin(pitch) * math.cos(roll), -math.sin(roll), math.cos(pitch) * math.cos(roll)
    c, s = math.cos(yaw), math.sin(yaw)
    cosine = xz * (c * ahead - s * left) + yz * (s * ahead + c * left) + zz * up
    angle = math.acos(max(-1.0, min(1.0, cosine)))
    std = _GRAVITY_STD_RAD if gravity.known else LEVEL_STD_RAD
    return pose.squared_error / variance + (angle / std) ** 2


def _differ(best: RelativePose, other: RelativePose) -> bool:
    """Return whether two solutions differ enough to matter: seen face on, they are nearly the same."""
    gap = np.append(other.position_m - best.position_m, difference(other.yaw_rad, best.yaw_rad))
    return float(gap @ np.linalg.solve(best.covariance + other.covariance, gap)) > 1.0


def pose_covariance(pose: PlanarPose, points: Array, intrinsics: CameraIntrinsics, floor_px: float) -> Array:
    """Return the covariance (6, 6) of (left rotation error [rad; optical], translation [m; optical]).

    s^2 (J^T J)^-1 with s^2 = squared error / (2n - 6) + floor^2.
    """
    turned = points @ pose.rotation.T
    by_point = intrinsics.project_jacobian(turned + pose.translation)
    # A left rotation error w moves a point by w x p, so d(pixel)/dw = -J [p]x.
    by_pose = np.empty((len(points), 2, 6))
    x, y, z = turned.T[:, :, None]
    by_x, by_y, by_z = by_point[..., 0], by_point[..., 1], by_point[..., 2]
    by_pose[..., 0], by_pose[..., 1], by_pose[..., 2] = y * by_z - z * by_y, z * by_x - x * by_z, x * by_y - y * by_x
    by_pose[..., 3:] = by_point
    jacobian = by_pose.reshape(-1, 6)
    variance = pose.squared_error / (len(jacobian) - 6) + floor_px**2
    return np.asarray(variance * np.linalg.solve(jacobian.T @ jacobian, np.eye(6)))


def relative_pose(
    pose: PlanarPose, points: Array, intrinsics: CameraIntrinsics, gravity: Gravity, floor_px: float
) -> RelativePose:
    """Return position, yaw and their covariance."""
    axis = gravity.stabilized_from_optical @ pose.rotation[:, 0]
    level = max(axis[0] ** 2 + axis[1] ** 2, 1e-6)
    yaw_by_turn = np.array([-axis[2] * axis[0] / level, -axis[2] * axis[1] / level, 1.0])
    mapping = np.zeros((4, 6))
    mapping[:3, 3:] = np.eye(3)
    mapping[3, :3] = yaw_by_turn @ gravity.stabilized_from_optical
    mapped = mapping @ pose_covariance(pose, points, intrinsics, floor_px) @ mapping.T
    return RelativePose(pose.translation, math.atan2(axis[1], axis[0]), 0.5 * (mapped + mapped.T))

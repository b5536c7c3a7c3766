"""Planar pose on projected corners: no pictures, only geometry and noise."""

import math

import numpy as np
import pytest

from drivers.camera import pose
from groundstation.geometry.angles import wrap
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.rotations import base_from_tilted_optical, rotation_from_euler

FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
POINTS = Checkerboard(5, 44.0).corners()
STABILIZED_FROM_OPTICAL = base_from_tilted_optical(math.radians(45))


def scene(random, range_m, tilt_deg=8.0):
    """Return optical_from_marker (rotation, translation), yaw and the carrier's (roll, pitch)."""
    roll, pitch = np.radians(random.normal(0, tilt_deg / 2, 2))
    yaw = random.uniform(-3, 3)
    rotation = STABILIZED_FROM_OPTICAL.T @ rotation_from_euler(roll, pitch, yaw)
    ray = np.array([random.uniform(-0.4, 0.4), random.uniform(-0.25, 0.25), 1.0])
    return rotation, ray * range_m / np.linalg.norm(ray), yaw, (roll, pitch)


def corners_of(rotation, translation, random=None, noise_px=0.0):
    pixels = FRONT.project(POINTS @ rotation.T + translation)
    return pixels if random is None else pixels + random.normal(0, noise_px, pixels.shape)


def test_exact_corners_give_the_exact_pose():
    random = np.random.default_rng(0)
    for _ in range(20):
        rotation, translation, _, (roll, pitch) = scene(random, 1.5)
        poses = pose.planar_poses(corners_of(rotation, translation), POINTS, FRONT)
        choice = pose.choose(poses, POINTS, FRONT, pose.Gravity(STABILIZED_FROM_OPTICAL, roll, pitch, True), 0.1, 6.0)
        assert choice.best.position_m == pytest.approx(translation, abs=1e-5)
        assert choice.residual_px < 1e-3
        assert wrap(
            choice.best.yaw_rad - math.atan2(*(STABILIZED_FROM_OPTICAL @ rotation)[[1, 0], 0])
        ) == pytest.approx(0, abs=1e-4)


def test_gravity_picks_the_right_solution_where_the_residual_cannot():
    """The other attitude of a board far away fits nearly as well; with 0.2 px of noise it often fits better."""
    random = np.random.default_rng(1)
    by_residual = by_gravity = 0
    for _ in range(150):
        rotation, translation, _, attitude = scene(random, 3.0)
        poses = pose.planar_poses(corners_of(rotation, translation, random, 0.2), POINTS, FRONT)
        roll, pitch = np.array(attitude) + np.radians(random.normal(0, 2, 2))
        gravity = pose.Gravity(STABILIZED_FROM_OPTICAL, roll, pitch, True)
        tilt = [p.rotation[:, 2] @ rotation[:, 2] for p in poses]
        by_residual += tilt[int(np.argmin([p.squared_error for p in poses]))] < math.cos(math.radians(25))
        best = min(poses, key=lambda p: pose._cost(p, 0.04, gravity))
        by_gravity += best.rotation[:, 2] @ rotation[:, 2] < math.cos(math.radians(25))
    assert by_residual > 5
    assert by_gravity == 0


def test_covariance_matches_the_scatter():
    random = np.random.default_rng(2)
    rotation, translation, _, (roll, pitch) = scene(random, 2.0)
    gravity = pose.Gravity(STABILIZED_FROM_OPTICAL, roll, pitch, True)
    true_yaw = math.atan2(*(STABILIZED_FROM_OPTICAL @ rotation)[[1, 0], 0])
    errors, claimed = [], []
    for _ in range(300):
        poses = pose.planar_poses(corners_of(rotation, translation, random, 0.2), POINTS, FRONT)
        best = pose.choose(poses, POINTS, FRONT, gravity, 0.01, 6.0).best
        errors.append(np.append(best.position_m - translation, wrap(best.yaw_rad - true_yaw)))
        claimed.append(best.covariance)
    ratio = np.diag(np.cov(np.array(errors).T)) / np.diag(np.mean(claimed, axis=0))
    assert ratio == pytest.approx(1.0, abs=0.35)


def test_the_floor_keeps_a_perfect_fit_from_claiming_certainty():
    rotation, translation, _, (roll, pitch) = scene(np.random.default_rng(3), 2.0)
    poses = pose.planar_poses(corners_of(rotation, translation), POINTS, FRONT)
    gravity = pose.Gravity(STABILIZED_FROM_OPTICAL, roll, pitch, True)
    best = pose.choose(poses, POINTS, FRONT, gravity, 0.1, 6.0).best
    assert math.sqrt(best.covariance[2, 2]) > 0.003
    assert np.linalg.eigvalsh(best.covariance).min() > 0.0


def test_an_upright_board_before_a_level_camera_stays_ambiguous():
    """Gravity does not distinguish its two mirror attitudes: both are reported."""
    random = np.random.default_rng(4)
    level = base_from_tilted_optical(0.0)
    upright = rotation_from_euler(0.0, 0.0, math.radians(155)) @ np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    gravity = pose.Gravity(level, 0.0, 0.0, False)
    kept = 0
    for _ in range(20):
        corners = corners_of(level.T @ upright, np.array([0.1, 0.0, 3.5]), random, 0.25)
        choice = pose.choose(pose.planar_poses(corners, POINTS, FRONT), POINTS, FRONT, gravity, 0.1, 6.0)
        kept += choice.alternative is not None
    assert kept >= 5


def test_corners_no_ray_reaches_have_no_pose():
    assert pose.planar_poses(np.full((12, 2), 1e6), POINTS, FRONT) == []

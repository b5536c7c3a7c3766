"""Motion and observation models: exact Jacobians against central differences, yaw near +-pi included."""

import math

import numpy as np
import pytest

from groundstation.estimation import slots as s
from groundstation.estimation.gating import gate
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.motion import predict
from groundstation.estimation.parameters import WORLD_FROM_DOWN
from groundstation.estimation.relative_pose import pose_from_observation, relative_pose
from groundstation.geometry.rotations import base_from_tilted_optical, rotation_from_euler, rotation_z

MODELS = (OdometryRobot(), ConstantVelocityTarget(), FixedMount((0, 0, 4), 0.003, 0.01))
YAWS = (0.3, math.pi - 1e-9, -math.pi + 1e-9, 3.1, -2.0)
CAMERA = MountedCamera("a", base_from_tilted_optical(math.radians(45)), (0.09, 0.01, -0.02))


def tables():
    sizes = [len(model.labels) for model in MODELS]
    entities = np.array([[m.number, sum(sizes[:i]), sizes[i]] for i, m in enumerate(MODELS)], dtype=np.int64)
    aux = np.zeros((3, s.AUXILIARY_COLUMNS))
    aux[:, s.ACTIVE] = 1.0
    aux[0, [s.HELD_VX, s.HELD_VY, s.YAW_RATE]] = (0.5, -0.2, 0.8)
    return entities, np.array([m.row() for m in MODELS]), aux


@pytest.mark.parametrize("yaw", YAWS)
def test_prediction_jacobian_is_that_of_the_mean(yaw: float) -> None:
    entities, rows, aux = tables()
    n, dt, step = int(entities[:, s.ENTITY_SIZE].sum()), 0.01, 1e-6
    rng = np.random.default_rng(1)
    mean = rng.normal(0.0, 0.1, n)
    mean[s.YAW], mean[s.SCALE] = yaw, 1.1

    def moved(x):
        x = x.copy()
        predict(x, np.zeros((n, n)), entities, rows, aux, dt)
        return x

    F = np.empty((n, n))
    for j in range(n):
        difference = moved(mean + step * np.eye(n)[j]) - moved(mean - step * np.eye(n)[j])
        difference[s.YAW] = math.remainder(difference[s.YAW], math.tau)
        F[:, j] = difference / (2 * step)
    Q = np.zeros((n, n))
    predict(mean.copy(), Q, entities, rows, aux, dt)
    root = rng.normal(size=(n, n))
    P = root @ root.T
    predicted = P.copy()
    predict(mean.copy(), predicted, entities, rows, aux, dt)
    np.testing.assert_allclose(predicted, F @ P @ F.T + Q, atol=2e-8 * np.abs(P).max())
    assert np.array_equal(predicted, predicted.T)


def observe(observer, subject, p, model, rows=4):
    h, Ho, Hs = np.zeros(4), np.zeros((4, s.MAX_BLOCK)), np.zeros((4, s.MAX_BLOCK))
    relative_pose(observer, subject, p, model, CAMERA.row(), 0.05, -0.08, rows, h, Ho, Hs)
    return h, Ho, Hs


@pytest.mark.parametrize("yaw", YAWS)
@pytest.mark.parametrize("model", [OdometryRobot(marker_position_m=(0.05, -0.03, 0.08)), ConstantVelocityTarget()])
def test_observation_jacobians_agree_with_central_differences(yaw: float, model) -> None:
    observer = np.array([0.1, -0.2, 2.1, yaw, 0.01, -0.02, 0.0, 1.0, 0.0])
    robot = model.number == s.ODOMETRY_ROBOT
    subject = np.array([1.2, 0.4, 1.1, -yaw, 0.0, 0.0, 0.0, 1.0, 0.0]) if robot else np.array([1.2, 0.4, 0.1, -0.1])
    rows, p, step = (4 if robot else 3), model.row(), 1e-6
    _, Ho, Hs = observe(observer, subject, p, model.number, rows)
    for block, H, which in ((observer, Ho, 0), (subject, Hs, 1)):
        for j in range(len(block)):
            sides = []
            for sign in (1, -1):
                moved = block.copy()
                moved[j] += sign * step
                pair = (moved, subject) if which == 0 else (observer, moved)
                sides.append(observe(*pair, p, model.number, rows)[0])
            difference = sides[0] - sides[1]
            difference[3] = math.remainder(difference[3], math.tau)
            np.testing.assert_allclose(H[:rows, j], (difference / (2 * step))[:rows], atol=1e-7)


def test_observation_follows_the_geometry_of_the_frames() -> None:
    """Against rotation matrices written out independently of the kernel."""
    observer = np.array([0.1, -0.2, 2.1, 0.7, 0.0, 0.0, 0.0, 1.0, 0.0])
    subject = np.array([1.2, 0.4, 1.1, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    p = OdometryRobot(marker_position_m=(0.05, -0.03, 0.08)).row()
    h, _, _ = observe(observer, subject, p, s.ODOMETRY_ROBOT)
    marker = subject[:3] + rotation_z(2.0) @ p[:3]
    base = rotation_from_euler(0.05, -0.08, 0.7)
    expected = CAMERA.rotation.T @ (base.T @ (marker - observer[:3]) - np.array(CAMERA.translation))
    np.testing.assert_allclose(h[:3], expected, atol=1e-12)
    assert h[3] == pytest.approx(1.3)


def test_a_point_below_the_ceiling_camera_is_in_front_of_it() -> None:
    camera = MountedCamera("ceiling", WORLD_FROM_DOWN)
    mount = np.array([0.0, 0.0, 4.2, 0.0, 0.0, 0.0])
    h, Ho, Hs = np.zeros(4), np.zeros((4, s.MAX_BLOCK)), np.zeros((4, s.MAX_BLOCK))
    robot = np.array([0.5, 0.3, 1.2, 0.4, 0.0, 0.0, 0.0, 1.0, 0.0])
    p = OdometryRobot(marker_position_m=(0.0, 0.0, 0.1)).row()
    relative_pose(mount, robot, p, s.ODOMETRY_ROBOT, camera.row(), 0.0, 0.0, 4, h, Ho, Hs)
    np.testing.assert_allclose(h, [0.5, -0.3, 2.9, 0.4], atol=1e-12)


@pytest.mark.parametrize("yaw", YAWS)
def test_an_observation_without_noise_gives_back_the_pose(yaw: float) -> None:
    observer = np.array([0.1, -0.2, 2.1, yaw, 0.01, -0.02, 0.0, 1.0, 0.0])
    subject = np.array([1.2, 0.4, 1.1, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    p = OdometryRobot(marker_position_m=(0.05, -0.03, 0.08)).row()
    z, _, _ = observe(observer, subject, p, s.ODOMETRY_ROBOT)
    pose = np.zeros(4)
    pose_from_observation(observer, p, s.ODOMETRY_ROBOT, CAMERA.row(), 0.05, -0.08, z, pose)
    np.testing.assert_allclose(pose, subject[:4], atol=1e-12)


def test_gates_are_chi_square_quantiles() -> None:
    # Tables of the chi-square distribution.
    assert gate(0.95, 1) == pytest.approx(3.841, abs=1e-3)
    assert gate(0.99, 2) == pytest.approx(9.210, abs=1e-3)
    assert gate(0.997, 3) == pytest.approx(13.931, abs=1e-3)
    assert gate(0.95, 4) == pytest.approx(9.488, abs=1e-3)
    with pytest.raises(ValueError, match="degrees"):
        gate(0.95, 5)
    with pytest.raises(ValueError, match="probability"):
        gate(1.0, 1)

"""Angles, rotations and poses, with signs checked by hand against the glossary's frames."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from groundstation.geometry import angles, rotations
from groundstation.geometry.pose import Pose

ANGLE = st.floats(-3.1, 3.1)


@pytest.mark.parametrize(
    "angle, wrapped", [(0.0, 0.0), (math.pi, math.pi), (-math.pi, math.pi), (1.5 * math.pi, -0.5 * math.pi)]
)
def test_wrap(angle: float, wrapped: float) -> None:
    assert angles.wrap(angle) == pytest.approx(wrapped)


@settings(max_examples=100, deadline=None)
@given(st.floats(-1e4, 1e4))
def test_wrap_keeps_the_direction(angle: float) -> None:
    wrapped = angles.wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


def test_difference_turns_the_short_way() -> None:
    assert angles.difference(math.radians(-170), math.radians(170)) == pytest.approx(math.radians(20))


@settings(max_examples=50, deadline=None)
@given(ANGLE, st.floats(-1.5, 1.5), ANGLE)
def test_euler_angles_agree_with_scipy_and_return(roll: float, pitch: float, yaw: float) -> None:
    rotation = rotations.rotation_from_euler(roll, pitch, yaw)
    np.testing.assert_allclose(rotation, Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(rotations.euler_from_rotation(rotation), (roll, pitch, yaw), atol=1e-7)
    quaternion = angles.quaternion_from_euler(roll, pitch, yaw)
    np.testing.assert_allclose(Rotation.from_quat(quaternion, scalar_first=True).as_matrix(), rotation, atol=1e-12)
    np.testing.assert_allclose(angles.euler_from_quaternion(quaternion), (roll, pitch, yaw), atol=1e-7)


def test_nose_down_is_positive_pitch_and_right_side_down_positive_roll() -> None:
    forward, left = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    assert (rotations.rotation_from_euler(0.0, 0.1, 0.0) @ forward)[2] < 0
    assert (rotations.rotation_from_euler(0.1, 0.0, 0.0) @ left)[2] > 0


def test_a_camera_tilted_down_looks_forward_and_down_with_its_x_axis_to_the_right() -> None:
    base_from_optical = rotations.base_from_tilted_optical(math.radians(45))
    half = math.sqrt(0.5)
    np.testing.assert_allclose(base_from_optical @ [0.0, 0.0, 1.0], [half, 0.0, -half], atol=1e-12)
    np.testing.assert_allclose(base_from_optical @ [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(base_from_optical @ [0.0, 1.0, 0.0], [-half, 0.0, -half], atol=1e-12)


def test_poses_compose_and_invert() -> None:
    a_from_b = Pose(rotations.rotation_from_euler(0.1, 0.2, 0.3), np.array([1.0, 2.0, 3.0]))
    b_from_c = Pose(rotations.rotation_from_euler(-0.4, 0.1, 2.0), np.array([0.0, -1.0, 0.5]))
    points = np.array([[0.3, 0.1, -2.0], [1.0, 1.0, 1.0]])
    np.testing.assert_allclose(a_from_b.compose(b_from_c).apply(points), a_from_b.apply(b_from_c.apply(points)))
    np.testing.assert_allclose(a_from_b.inverse().apply(a_from_b.apply(points)), points, atol=1e-12)


@pytest.mark.parametrize("translation", [np.zeros(2), np.array([0.0, math.nan, 0.0])])
def test_a_pose_refuses_wrong_shapes_and_numbers(translation: np.ndarray) -> None:
    with pytest.raises(ValueError, match="translation"):
        Pose(np.eye(3), translation)

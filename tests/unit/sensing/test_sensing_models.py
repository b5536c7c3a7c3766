"""Cameras as the planner believes in them: frustum, noise, smooth availability and its derivatives."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.sensing.models import (
    Frustum,
    Noise,
    OnboardCameraModel,
    Rectangle,
    SensorSuite,
    Softness,
    WorldCameraModel,
)
from groundstation.sensing.visibility import camera_rows, observe

CEILING = WorldCameraModel((0.0, 0.0, 4.2), Frustum.of_picture(1280, 720, 1179, 1179, 5.0, border_m=0.0))
ONBOARD = OnboardCameraModel((0.09, 0.0, 0.0), Frustum.of_picture(640, 360, 460, 460, 1.9, border_m=0.0))
SUITE = SensorSuite({"ceiling": CEILING}, {"a": ONBOARD}, {"a": 0.08, "target": 0.4})
POINT = st.tuples(*[st.floats(-3, 3)] * 3)


def informations(camera: WorldCameraModel | OnboardCameraModel, point: Sequence[float]) -> np.ndarray:
    x, y, z = point
    return np.array(observe(camera_rows([camera], SUITE.softness)[0], x, y, z))


def test_the_ceiling_footprint_shrinks_with_height() -> None:
    low, high = SUITE.root_views(1.3)[0], SUITE.root_views(2.2)[0]
    assert low.x_m[1] == pytest.approx(1.57, abs=0.01) and low.y_m[1] == pytest.approx(0.89, abs=0.01)
    assert high.x_m[1] == pytest.approx(1.09, abs=0.01) and high.y_m[1] == pytest.approx(0.61, abs=0.01)
    assert SUITE.root_views(4.5) == ()
    inside, outside = np.array([1.5, 0.8, 1.3]), np.array([1.6, 0.0, 1.3])
    assert SUITE.world_in_view("ceiling", inside) and not SUITE.world_in_view("ceiling", outside)


SIGHTS = [(0.9, 0.0, True), (0.2, 0.0, False), (-0.9, 0.0, False), (2.3, 0.0, False), (0.9, 1.2, False)]


@pytest.mark.parametrize(("x", "y", "seen"), SIGHTS)
def test_a_camera_tilted_down_sees_ahead_and_below(x: float, y: float, seen: bool) -> None:
    for yaw in (0.0, 2.0, -3.1):
        c, s = math.cos(yaw), math.sin(yaw)
        point = np.array([1.0 + c * x - s * y, 2.0 + s * x + c * y, 0.4])
        assert SUITE.onboard_in_view("a", np.array([1.0, 2.0, 1.3, yaw]), point) is seen


def test_the_border_keeps_a_whole_board_in_the_picture() -> None:
    tight = Frustum(0.5, 0.5, 10.0, border_m=0.15)
    assert Frustum(0.5, 0.5, 10.0, 0.0).margin(np.array([0.45, 0.0, 1.0])) > 0
    assert tight.margin(np.array([0.45, 0.0, 1.0])) < 0 < tight.margin(np.array([0.3, 0.0, 1.0]))


@given(POINT, st.sampled_from([CEILING, ONBOARD]))
@settings(max_examples=60, deadline=None)
def test_derivatives_agree_with_central_differences(
    point: tuple[float, float, float], camera: WorldCameraModel | OnboardCameraModel
) -> None:
    out = informations(camera, point)
    for axis in range(3):
        ahead, behind = list(point), list(point)
        ahead[axis] += 1e-6
        behind[axis] -= 1e-6
        slope = (informations(camera, ahead) - informations(camera, behind)) / 2e-6
        scale = max(1.0, float(np.abs(out).max()))
        assert out[1 + axis] == pytest.approx(slope[0], rel=1e-5, abs=1e-5 * scale)
        assert out[5 + axis] == pytest.approx(slope[4], rel=1e-5, abs=1e-5 * scale)


@given(POINT, st.sampled_from([CEILING, ONBOARD]))
@settings(max_examples=60, deadline=None)
def test_soft_availability_follows_the_hard_one_and_never_vanishes(
    point: tuple[float, float, float], camera: WorldCameraModel | OnboardCameraModel
) -> None:
    margin = camera.view.margin(np.array(point))
    availability = informations(camera, point)[0] * camera.noise.position_std_m(float(np.linalg.norm(point))) ** 2
    assert availability > 1e-5
    if margin < -0.2:
        assert availability < 0.1
    if margin > 0.35:
        assert availability > 0.9


def test_what_is_lost_still_pulls() -> None:
    out = informations(ONBOARD, (0.0, -6.0, -5.0))
    assert float(np.linalg.norm(out[1:4])) > 1e-5
    assert out[1:4] @ np.array([0.0, 6.0, 7.0]) > 0  # towards the axis


def test_noise_grows_with_range() -> None:
    noise = Noise(0.02, 0.0175, 0.004)
    stds = [noise.position_std_m(d) for d in (0.5, 1.0, 1.5, 2.0)]
    assert stds == sorted(stds)
    assert noise.position_std_m(1.0) == pytest.approx(math.sqrt(0.02**2 + 0.0175**2 + 0.004**2))


def test_rectangles_shrink_to_their_middle_at_most() -> None:
    box = Rectangle((-1.0, 1.0), (-0.2, 0.2))
    assert box.shrunk(0.5) == Rectangle((-0.5, 0.5), (0.0, 0.0))
    assert box.nearest(3.0, -0.1) == (1.0, -0.1)
    assert box.center == (0.0, 0.0)
    assert Softness().tail_share < 0.01

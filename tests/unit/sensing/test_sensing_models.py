"""The planner's camera models: frustum, noise, smooth availability and its derivatives."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.sensing.models import (
    Frustum,
    Noise,
    OnboardCameraModel,
    Rectangle,
    SensorSuite,
    Softness,
    WorldCameraModel,
)
from groundstation.sensing.visibility import available, camera_rows, limits_of, margin

CEILING = WorldCameraModel((0.0, 0.0, 4.2), Frustum.of_picture(1280, 720, 1179, 1179, 5.0, border_m=0.0))
ONBOARD = OnboardCameraModel((0.09, 0.0, 0.0), Frustum.of_picture(640, 360, 460, 460, 1.9, border_m=0.0))
SUITE = SensorSuite({"ceiling": CEILING}, {"a": ONBOARD}, {"a": 0.08, "target": 0.4})
POINT = st.tuples(*[st.floats(-3, 3)] * 3)


def mounted(rotation_deg: Sequence[float], view: Frustum) -> WorldCameraModel:
    """Return a ceiling camera that is turned from looking down by (roll, pitch, yaw) [deg]."""
    return replace(CEILING, view=view, optical_from_world=world_from_downward_optical(rotation_deg).T)


def availability(
    camera: WorldCameraModel | OnboardCameraModel,
    point: Sequence[float],
    blur_m2: float = 0.0,
    turn_rad2: float = 0.0,
    soft: Softness = SUITE.softness,
) -> np.ndarray:
    """Return the availability of a marker at an optical point, then its derivatives."""
    x, y, z = point
    return np.array(available(limits_of(camera_rows([camera], soft)[0]), x, y, z, blur_m2, turn_rad2, soft.tail_share))


def test_the_ceiling_footprint_shrinks_with_height() -> None:
    low, high = SUITE.root_views(1.3)[0], SUITE.root_views(2.2)[0]
    assert low.x_m[1] == pytest.approx(1.57, abs=0.01) and low.y_m[1] == pytest.approx(0.89, abs=0.01)
    assert high.x_m[1] == pytest.approx(1.09, abs=0.01) and high.y_m[1] == pytest.approx(0.61, abs=0.01)
    assert SUITE.root_views(4.5) == ()
    inside, outside = np.array([1.5, 0.8, 1.3]), np.array([1.6, 0.0, 1.3])
    assert SUITE.world_in_view("ceiling", inside) and not SUITE.world_in_view("ceiling", outside)


@given(
    st.tuples(st.floats(-89.0, 89.0), st.floats(-89.0, 89.0), st.floats(-180.0, 180.0)),
    st.floats(0.0, 4.1),
    st.sampled_from([1.0, 3.0, 5.0]),
)
@settings(max_examples=200, deadline=None)
def test_all_of_a_root_view_is_seen_however_the_camera_is_mounted(
    rotation_deg: tuple[float, float, float], height_m: float, range_m: float
) -> None:
    """Turned by 30 degrees, a quarter of the rectangle was out of sight."""
    view = replace(CEILING.view, range_m=range_m, border_m=0.15)
    suite = replace(SUITE, world={"ceiling": mounted(rotation_deg, view)})
    for x, y in (corner for one in suite.root_views(height_m) for corner in one.shrunk(1e-6).corners):
        assert suite.world_in_view("ceiling", np.array([x, y, height_m]))


@pytest.mark.parametrize(
    ("rotation_deg", "least_m2"),
    [
        ((0, 8.5, 0), 4.2),
        ((25, 0, 0), 5.2),
        ((0, 40, 0), 4.9),
        ((0, 0, 20), 2.0),
        ((0, 0, 45), 1.3),
        ((5, 5, 30), 1.58),
    ],
)
def test_a_tilted_or_turned_camera_has_a_root_view_too(
    rotation_deg: tuple[float, float, float], least_m2: float
) -> None:
    """At least nine tenths of the largest rectangle that it shows 2.7 m below it, found by a search on a grid."""
    view = replace(SUITE, world={"ceiling": mounted(rotation_deg, CEILING.view)}).root_views(1.5)[0]
    assert (view.x_m[1] - view.x_m[0]) * (view.y_m[1] - view.y_m[0]) > least_m2


def test_a_quarter_turn_turns_the_root_view() -> None:
    straight, turned = (
        replace(SUITE, world={"ceiling": mounted((0, 0, yaw), CEILING.view)}).root_views(1.5) for yaw in (0, 90)
    )
    assert turned[0].x_m == pytest.approx(straight[0].y_m) and turned[0].y_m == pytest.approx(straight[0].x_m)


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


@given(POINT, st.sampled_from([CEILING, ONBOARD]), st.sampled_from([(0.0, 0.0), (0.04, 0.0), (0.01, 0.02)]))
@settings(max_examples=90, deadline=None)
def test_derivatives_agree_with_central_differences(
    point: tuple[float, float, float], camera: WorldCameraModel | OnboardCameraModel, spread: tuple[float, float]
) -> None:
    out = availability(camera, point, *spread)
    for axis in range(3):
        ahead, behind = list(point), list(point)
        ahead[axis] += 1e-6
        behind[axis] -= 1e-6
        slope = (availability(camera, ahead, *spread) - availability(camera, behind, *spread)) / 2e-6
        assert out[1 + axis] == pytest.approx(slope[0], rel=1e-5, abs=1e-5)


@given(POINT)
@settings(max_examples=60, deadline=None)
def test_soft_availability_follows_the_hard_one_and_never_vanishes(point: tuple[float, float, float]) -> None:
    margin, found = CEILING.view.margin(np.array(point)), availability(CEILING, point)[0]
    assert found > 1e-5
    if margin < -0.2:
        assert found < 0.1
    if margin > 0.35 and point[2] > math.cos(math.radians(65.0)) * math.hypot(*point):
        assert found > 0.9


PLACES = [(0.0, 0.0, 1.2), (0.1, -0.1, 1.4), (0.3, 0.35, 1.5), (-0.9, 0.0, 1.5), (0.0, 0.0, 2.1), (0.6, 0.0, 1.4)]


@pytest.mark.parametrize("point", PLACES)
def test_availability_without_caution_is_expected_under_the_covariance(point: tuple[float, float, float]) -> None:
    """Compared with sampling, for positions and directions of that uncertainty."""
    at_mean, soft = availability(ONBOARD, point)[0], Softness(caution=0.0)
    for blur, turn, tolerance in ((0.01, 0.0, 0.07), (0.04, 0.01, 0.2)):
        std = math.sqrt(blur + turn * float(np.dot(point, point)))
        samples = np.array(point) + np.random.default_rng(2).normal(0.0, std, (1000, 3))
        mean = float(np.mean([availability(ONBOARD, sample)[0] for sample in samples]))
        expected = availability(ONBOARD, point, blur, turn, soft)[0]
        assert expected == pytest.approx(mean, abs=tolerance)
        assert abs(expected - mean) < abs(at_mean - mean)


@pytest.mark.parametrize("point", PLACES)
def test_a_view_is_counted_on_as_far_inside_as_its_place_is_in_doubt(point: tuple[float, float, float]) -> None:
    """A position error lasts: at the very edge a marker is seen all the time or never, not every other time."""
    doubt_m, soft = 0.1, Softness(tail_share=0.0)
    row, distance = camera_rows([ONBOARD], soft)[0], math.hypot(*point)
    inside = margin(limits_of(row), *point, distance).a - 1.5 * doubt_m
    width = math.hypot(soft.width_m, math.sqrt(math.pi / 8) * doubt_m)
    careful = availability(ONBOARD, point, doubt_m**2, soft=soft)[0]
    assert careful == pytest.approx(1.0 / (1.0 + math.exp(-inside / width)), rel=1e-4)
    assert careful < availability(ONBOARD, point, doubt_m**2, soft=replace(soft, caution=0.0))[0]


def test_a_marker_seen_too_obliquely_is_not_found() -> None:
    level = OnboardCameraModel((0.0, 0.0, 0.0), Frustum.of_picture(640, 360, 460, 460, 5.0, border_m=0.0), 0.1)
    flat, steep = np.array([2.0, 0.0, -0.3]), np.array([1.0, 0.0, -0.42])
    assert availability(level, level.optical_from_base @ flat)[0] < 0.01
    assert availability(level, level.optical_from_base @ steep)[0] > 0.4


def test_availability_out_of_view_has_a_gradient_towards_the_axis() -> None:
    out = availability(ONBOARD, (0.0, -6.0, -5.0))
    assert float(np.linalg.norm(out[1:4])) > 1e-6
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

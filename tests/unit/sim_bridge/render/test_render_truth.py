"""Rendered pictures against single rays, and the scenario's options: shutter, light, floors, tags."""

import math

import cv2
import numpy as np
import pytest

from drivers.camera.detect import find_board, refined, spacing_px, window_around
from groundstation.geometry import board as marker
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.geometry.tag import SquareTag
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.scene import compose_scene
from sim_bridge.render.spec import BoardSpec, BodyShape, FloorKind, Mount, PictureQuality, RenderSpec

FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
MOUNT = Mount(Pose(base_from_tilted_optical(math.radians(45)), np.zeros(3)), "drone_1")
IDEAL = PictureQuality(corner_noise_px=0.0, pixel_noise=0.0, blur_px=0.0, exposure_ms=0.0)
BOT = BoardSpec("bot", 5, 44.0, (0.0, 0.0, 0.4), BodyShape.TURTLEBOT)
RAYS = 8


def make(scenario=IDEAL, boards=(BOT,), mount=MOUNT):
    bodies = ("drone_1", *(board.body for board in boards))
    return Renderer(RenderSpec("c", mount, FRONT, boards, "t", bodies, "127.0.0.1", 0, scenario))


def state(x, y, z, yaw=0.0, roll=0.0, pitch=0.0, velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0)):
    return [x, y, z, *velocity, roll, pitch, yaw, *rates, 0.0]


def sight_of(renderer, states, body="bot"):
    return next(s for s in compose_scene(renderer._spec, np.array(states)).sights if s.board.body == body)


def cast(pose, window, code=5, square_m=0.044):
    """Return the board's grey in the window, the mean of 8 x 8 rays per pixel; NaN where a ray misses the card."""
    left, top, right, bottom = window
    steps = (np.arange(RAYS) + 0.5) / RAYS - 0.5
    u = (np.arange(left, right)[:, None] + steps).ravel()
    v = (np.arange(top, bottom)[:, None] + steps).ravel()
    rays = FRONT.normalised_from_pixels(np.stack(np.meshgrid(u, v), axis=-1))
    homogeneous = np.concatenate((rays, np.ones((*rays.shape[:2], 1))), axis=-1)
    lifted = homogeneous @ np.linalg.inv(np.column_stack((pose.rotation[:, :2], pose.translation))).T
    x, y = (lifted[..., i] / lifted[..., 2] / square_m for i in (0, 1))
    grey = np.full(x.shape, float(marker.WHITE))
    for x0, x1, y0, y1 in marker.dark_rectangles(code):
        grey[(x >= x0) & (x < x1) & (y >= y0) & (y < y1)] = marker.BLACK
    x0, x1, y0, y1 = marker.EXTENT
    grey[(x < x0) | (x > x1) | (y < y0) | (y > y1)] = np.nan
    return grey.reshape(bottom - top, RAYS, right - left, RAYS).mean(axis=(1, 3))


def test_corners_agree_with_rays_to_hundredths_of_a_pixel():
    """The same corner finder on both pictures: the difference is the renderer's own error."""
    renderer, random, gaps = make(), np.random.default_rng(3), list[np.ndarray]()
    while len(gaps) < 25:
        x, y = random.uniform([1.2, -0.6], [2.6, 0.6])
        states = [state(0, 0, 2.2), state(x, y, 0.0, random.uniform(-3, 3))]
        pose = sight_of(renderer, states).optical_from_marker
        corners, card = (
            FRONT.project(pose.apply(p)) for p in (Checkerboard(5, 44.0).corners(), Checkerboard(5, 44.0).outline())
        )
        if not FRONT.contains(card, 8.0).all():
            continue
        window = window_around(card, 3.0, (360, 640))
        assert window is not None
        rendered = renderer.render(np.array(states))
        truth = rendered.copy()
        rays = cast(pose, window)
        part = truth[window.top : window.bottom, window.left : window.right]
        part[np.isfinite(rays)] = np.rint(rays[np.isfinite(rays)])
        sharp = [np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.7)) for picture in (rendered, truth)]
        gaps.append(refined(sharp[0], corners) - refined(sharp[1], corners))
    errors = np.array(gaps)
    assert np.abs(errors.mean(axis=(0, 1))).max() <= 0.01
    assert np.sqrt((errors**2).mean()) <= 0.1


def test_a_rolling_shutter_shears_what_moves_and_nothing_else():
    rolling = PictureQuality(
        corner_noise_px=0.0, pixel_noise=0.0, blur_px=0.5, exposure_ms=0.0, rolling_shutter_ms=30.0
    )
    renderer, still = make(rolling), [state(0, 0, 2.0), state(1.6, 0.0, 0.0, 0.4)]
    ordinary = make(PictureQuality(corner_noise_px=0.0, pixel_noise=0.0, blur_px=0.5, exposure_ms=0.0))
    assert np.abs(renderer.render(np.array(still)).astype(int) - ordinary.render(np.array(still))).max() <= 1
    moving = [still[0], state(1.6, 0.0, 0.0, 0.4, velocity=(0.0, -1.0, 0.0))]
    pose = sight_of(renderer, moving).optical_from_marker
    truth = FRONT.project(pose.apply(Checkerboard(5, 44.0).corners()))
    find = refined(renderer.render(np.array(moving)), truth)
    shift = find - truth
    # By hand: 1 m/s to the right at f / z, times each row's time from the middle one.
    z = pose.apply(Checkerboard(5, 44.0).corners())[:, 2]
    expected = 460.0 / z * 0.030 * (truth[:, 1] / 359.0 - 0.5)
    assert shift[:, 0] == pytest.approx(expected, abs=0.25)
    assert np.abs(shift[:, 1]).max() < 0.25


def test_little_light_darkens_and_photon_noise_grows_with_the_light():
    states = np.array([state(0, 0, 2.0), state(1.6, 0.0, 0.0)])
    clean = make(IDEAL).render(states).astype(float)
    dark = make(PictureQuality(0, light=0.25, corner_noise_px=0, pixel_noise=0, blur_px=0, exposure_ms=0)).render(
        states
    )
    assert dark == pytest.approx(0.25 * clean, abs=1.01)
    noisy = make(PictureQuality(0, shot_noise=8.0, corner_noise_px=0, pixel_noise=0, blur_px=0, exposure_ms=0))
    noise = noisy.render(states).astype(float) - clean
    bright, black = noise[clean > 200], noise[clean < 45]
    assert bright.std() == pytest.approx(8.0 * math.sqrt(230 / 255), rel=0.15)
    assert black.std() == pytest.approx(8.0 * math.sqrt(40 / 255), rel=0.25)
    assert abs(noise.mean()) < 0.3


def test_a_turning_camera_smears_the_floor():
    turning = np.array([state(0, 0, 2.0, rates=(0.0, 0.0, 2.0)), state(9, 9, 9)])
    sharp, smeared = (make(PictureQuality(0, exposure_ms=ms, pixel_noise=0)).render(turning) for ms in (0.0, 15.0))
    assert cv2.Laplacian(smeared, cv2.CV_64F).var() < 0.6 * cv2.Laplacian(sharp, cv2.CV_64F).var()


def test_floors_differ():
    nothing = np.array([state(0, 0, 2.0), state(9, 9, 9)])
    pictures = [make(PictureQuality(0, floor=kind, pixel_noise=0)).render(nothing).astype(int) for kind in FloorKind]
    for first in range(4):
        for second in range(first):
            assert np.abs(pictures[first] - pictures[second]).mean() > 4.0


def test_a_drone_hides_the_board_behind_it():
    """The camera looks down at a TurtleBot; a drone hovers on the line of sight, half a metre before the camera."""
    boards = (BoardSpec("drone_2", 2, 44.0, (0.0, 0.0, 0.08)), BOT)
    renderer, target = make(PictureQuality(0, corner_noise_px=0), boards), state(1.6, 0.0, 0.0)
    away, between = state(9, 9, 1), state(1.0, 0.0, 0.92)
    corners = FRONT.project(
        sight_of(renderer, [state(0, 0, 2.0), away, target]).optical_from_marker.apply(Checkerboard(5, 44.0).corners())
    )
    spacing = spacing_px(corners)
    window = window_around(corners, 1.6 * spacing + 6.0, (360, 640))
    assert window is not None
    free = renderer.render(np.array([state(0, 0, 2.0), away, target]))
    hidden = renderer.render(np.array([state(0, 0, 2.0), between, target]))
    assert find_board(free, window, spacing) is not None
    seen = find_board(hidden, window, spacing)
    assert seen is None or np.abs(seen.corners - corners).max() > 3.0


@pytest.mark.parametrize("dictionary", ["DICT_4X4_50", "DICT_APRILTAG_36H11"])
def test_a_tag_is_drawn_where_projection_says(dictionary):
    tag = SquareTag(dictionary, 7, 168.0)
    board = BoardSpec("bot", 0, 0.0, (0.0, 0.0, 0.4), BodyShape.TURTLEBOT, tag)
    renderer = make(PictureQuality(0, corner_noise_px=0, exposure_ms=0), (board,))
    states = [state(0, 0, 1.6), state(1.2, 0.1, 0.0, 0.5)]
    truth = FRONT.project(sight_of(renderer, states).optical_from_marker.apply(tag.corners()))
    finder = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)))
    corners, ids, _ = finder.detectMarkers(renderer.render(np.array(states)))
    assert np.ravel(ids).tolist() == [7]
    # Whole pixels: this finder does not refine. Only the order of the corners matters here.
    assert np.reshape(corners, (4, 2)) == pytest.approx(truth, abs=1.6)

"""How far boards are found, with and without knowing where to look (640x360, clean pictures)."""

import math

import numpy as np
import pytest

from drivers.camera.detect import find_board, spacing_px, window_around
from drivers.camera.search import search
from groundstation.geometry.board import Board
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.scene import compose_scene
from sim_bridge.render.spec import BoardSpec, BodyShape, CameraScenario, Mount, RenderSpec

pytestmark = [pytest.mark.slow, pytest.mark.statistics]
FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
CLEAN = CameraScenario(corner_noise_px=0.0, pixel_noise=2.0, blur_px=0.7, exposure_ms=0.0)


def sights(range_m, count):
    """Yield pictures with one board at a range (up to 60 deg from face on), and its true corners [px]."""
    mount = Mount(Pose(base_from_tilted_optical(math.radians(45)), np.zeros(3)), "drone_1")
    boards = (BoardSpec("bot", 5, 44.0, (0.0, 0.0, 0.4), BodyShape.TURTLEBOT),)
    spec = RenderSpec("drone_1", mount, FRONT, boards, "t", ("drone_1", "bot"), "127.0.0.1", 0, CLEAN)
    renderer, random = Renderer(spec), np.random.default_rng(round(10 * range_m))
    while count:
        states = np.zeros((2, 13))
        states[0, 2], states[0, 8] = 2.2, random.uniform(-3, 3)
        camera = compose_scene(spec, states).world_from_optical
        ray = np.array([random.uniform(-0.4, 0.4), random.uniform(-0.25, 0.25), 1.0])
        states[1, :3] = camera.apply(ray * range_m / np.linalg.norm(ray)) - (0, 0, 0.4)
        states[1, 6:9] = *random.normal(0, 0.1, 2), random.uniform(-3, 3)
        truth = compose_scene(spec, states).sights[0].optical_from_marker
        direction = truth.translation / np.linalg.norm(truth.translation)
        if -truth.rotation[:, 2] @ direction < math.cos(math.radians(60)):
            continue
        if not FRONT.contains(FRONT.project(truth.apply(Board(5, 44.0).outline())), 12.0).all():
            continue
        count -= 1
        yield renderer.render(states), FRONT.project(truth.apply(Board(5, 44.0).corners()))


def is_right(find, corners):
    return find is not None and float(np.abs(find.corners - corners).max()) < 3.0


@pytest.mark.parametrize("range_m", [1.0, 2.0, 3.0, 4.0])
def test_found_where_expected(range_m):
    random, right = np.random.default_rng(0), 0
    for picture, corners in sights(range_m, 60):
        spacing = spacing_px(corners) * random.uniform(0.87, 1.15)
        window = window_around(corners + random.uniform(-6, 6, 2), 1.6 * spacing + 8.0, picture.shape)
        right += is_right(find_board(picture, window, spacing), corners)
    assert right >= 0.95 * 60


@pytest.mark.parametrize("range_m", [1.0, 1.5, 2.0, 2.5, 3.0])
def test_found_by_searching(range_m):
    right = sum(
        any(is_right(find, corners) for find in search(picture, [])) for picture, corners in sights(range_m, 60)
    )
    assert right >= 0.85 * 60

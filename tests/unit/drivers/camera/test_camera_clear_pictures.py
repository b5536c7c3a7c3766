"""Dark, white and fogged pictures prove nobody's absence; those of plain floors do."""

import math
from collections.abc import Iterator
from functools import cache

import cv2
import numpy as np
import pytest
from fake_camera import FakeChild, FakeSource, settings

from drivers.camera import driver
from drivers.camera.clear_pictures import ClearPictures
from drivers.camera.search import search
from groundstation.arrays import Image
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.topics import SEARCHED_PICTURE
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.spec import BoardSpec, BodyShape, FloorKind, Mount, PictureQuality, RenderSpec

LENS = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
DOWN = np.diag([1.0, -1.0, -1.0])
BLACK, GREY, WHITE = 0.0, 128.0, 252.0
FLOORS = list(FloorKind)


@cache
def view(floor: FloorKind, marked: bool = False, x_m: float = 0.0) -> Image:
    """A noiseless picture from 2 m above a floor, with a board in the middle or nobody."""
    quality = PictureQuality(exposure_ms=0.0, pixel_noise=0.0, corner_noise_px=0.0, floor=floor)
    boards = (BoardSpec("bot", 5, 44.0, (0.0, 0.0, 0.4), BodyShape.TURTLEBOT),)
    mount = Mount(Pose(DOWN, np.array([x_m, 0.0, 2.0])))
    states = np.zeros((1, 13))
    states[0, 0] = x_m if marked else 50.0
    return Renderer(RenderSpec("c", mount, LENS, boards, "", ("bot",), "", 0, quality)).render(states)


def shown(light: Image, share: float, veil: float, noise: float = 2.0, seed: int = 1) -> Image:
    """A picture with this share of its contrast, the rest veiled by one grey level, as its sensor gives it."""
    rng = np.random.default_rng(seed)
    grey = veil + share * (light.astype(np.float64) - veil) + rng.normal(0.0, noise, light.shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("floor", FLOORS)
@pytest.mark.parametrize("stands", [True, False])
def test_a_floor_without_anybody_is_clear_before_and_after_a_marker_was_seen(floor: FloorKind, stands: bool) -> None:
    judge = ClearPictures(stands=stands)
    for share in (1.0, 0.35):
        assert judge.is_clear(shown(view(floor), share, BLACK), False)
        assert judge.is_clear(shown(view(floor, marked=True), share, BLACK), True)
        assert judge.is_clear(shown(view(floor), share, BLACK), False)


@pytest.mark.parametrize("noise", [2.0, 8.0])
@pytest.mark.parametrize("veil", [BLACK, GREY, WHITE])
@pytest.mark.parametrize("floor", FLOORS)
def test_where_no_board_is_found_an_empty_picture_of_a_known_scene_is_not_clear(
    floor: FloorKind, veil: float, noise: float
) -> None:
    judge = ClearPictures(stands=True)
    assert search(shown(view(floor, marked=True), 1.0, veil), [])
    assert not search(shown(view(floor, marked=True), 0.07, veil, noise), [])
    assert judge.is_clear(shown(view(floor, marked=True), 1.0, veil, noise), True)
    assert not judge.is_clear(shown(view(floor), 0.05, veil, noise), False)
    assert judge.is_clear(shown(view(floor), 1.0, veil, noise), False), "it clears up"


@pytest.mark.parametrize("noise", [0.0, 3.0, 12.0])
@pytest.mark.parametrize("veil", [BLACK, GREY, WHITE])
def test_noise_alone_is_not_clear(veil: float, noise: float) -> None:
    assert not ClearPictures(stands=True).is_clear(shown(view(FloorKind.TILES), 0.0, veil, noise), False)


def test_pictures_as_dark_as_one_that_showed_a_marker_are_clear() -> None:
    """A black mat in good light: its contrast is enough, and markers on it were found."""
    mat, judge = shown(view(FloorKind.TILES), 0.1, BLACK), ClearPictures(stands=True)
    assert not judge.is_clear(mat, False)
    assert judge.is_clear(mat, True) and judge.is_clear(mat, False)


def pictures(kind: str) -> Iterator[Image]:
    floor, (share, veil) = view(FloorKind.CONCRETE), {
        "dark": (0.0, 3.0), "fogged": (0.0, 120.0), "white": (0.0, 252.0), "a floor": (1.0, 0.0),
    }[kind]  # fmt: skip
    return (shown(floor, share, veil, noise=3.0, seed=k) for k in range(40))


@pytest.mark.parametrize(("kind", "told"), [("dark", 0), ("fogged", 0), ("white", 0), ("a floor", 5)])
@pytest.mark.parametrize("mount", ["drone_1", "world"])
def test_a_camera_tells_that_it_searched_only_pictures_that_could_show_somebody(
    kind: str, told: int, mount: str
) -> None:
    exchange = MemoryExchange()
    child, source = FakeChild(MemoryBus(exchange, "lab", "drone_1_camera")), FakeSource()
    heard = MemoryBus(exchange, "lab", "test").subscribe([SEARCHED_PICTURE])
    fixed = {"name": "ceiling", "mount": {"parent": "world", "looking": "down"}} if mount == "world" else {}
    camera = driver.CameraDriver(child, settings(**fixed), source)
    for k, picture in enumerate(pictures(kind)):
        source.push(cv2.imencode(".jpg", picture)[1].tobytes(), 10**12 + k * 66_666_667)
        camera.turn()
    assert len(heard.drain()) == pytest.approx(told, abs=1 if told else 0)
    assert (camera._pipeline.counts["unclear"] > 0) == (not told)


def test_light_that_fails_ends_the_reports_before_boards_are_lost() -> None:
    """As the light goes, no empty picture counts any more in which a board would be missed."""
    floor, board = view(FloorKind.CARPET), view(FloorKind.CARPET, marked=True)
    judge = ClearPictures(stands=True)
    assert judge.is_clear(shown(board, 1.0, BLACK), True)
    lights = [math.exp(-0.2 * k) for k in range(20)]
    counts = [judge.is_clear(shown(floor, light, BLACK), False) for light in lights]
    finds = [bool(search(shown(board, light, BLACK), [])) for light in lights]
    assert counts == sorted(counts, reverse=True) and finds == sorted(finds, reverse=True)
    assert abs(sum(counts) - sum(finds)) <= 1, list(zip(lights, counts, finds, strict=True))


def test_one_picture_of_great_contrast_does_not_make_a_plain_floor_unclear() -> None:
    """A strip of sun, or a hull near the lens: ten times the contrast of the floor without it."""
    plain, judge = shown(view(FloorKind.CONCRETE), 0.6, GREY), ClearPictures(stands=True)
    board = shown(view(FloorKind.CONCRETE, marked=True), 0.6, GREY)
    sunny = board.copy()
    sunny[:, :80], sunny[:, -80:] = 255, 0
    for _ in range(5):
        assert judge.is_clear(board, True) and judge.is_clear(plain, False)
    assert judge.is_clear(sunny, True) and judge.is_clear(plain, False)

"""Markers in view that give no sighting: a searched picture must not say that their carriers are elsewhere."""

import math

import cv2
import numpy as np
import pytest
from fake_camera import FakeChild, FakeSource, settings

from drivers.camera import driver, pose
from drivers.camera.convert import stabilized_from_optical
from drivers.camera.pipeline import Pipeline
from drivers.camera.settings import DetectorSettings, MarkerSettings, MountSettings, TagSettings
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import SearchedPicture
from groundstation.bus.topics import SEARCHED_PICTURE
from groundstation.geometry import board
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.geometry.tag import SquareTag
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.scene import compose_scene
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, PictureQuality, RenderSpec

FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5)
MOUNT = MountSettings(parent="drone_1", tilt_down_deg=45.0)
FAMILY = "DICT_4X4_50"
BOARDS = (
    MarkerSettings(entity="drone_2", code=2, square_mm=44.0),
    MarkerSettings(entity="bot", code=5, square_mm=44.0),
)
TAGS = (
    BOARDS[0],
    MarkerSettings(entity="bot", tag=TagSettings(dictionary=FAMILY, id=7, size_mm=168.0)),
)


def picture_of(codes: tuple[int, int] = (2, 5), tag: bool = False, glare: str = "") -> np.ndarray:
    """Return a picture of drone_2 and the target; glare: whose bar is white with light."""
    mount = Mount(Pose(base_from_tilted_optical(math.radians(45)), np.zeros(3)), "drone_1")
    boards = (
        BoardSpec("drone_2", codes[0], 44.0, (0.0, 0.0, 0.08)),
        BoardSpec(
            "bot", codes[1], 44.0, (0.0, 0.0, 0.4), BodyShape.TURTLEBOT, SquareTag(FAMILY, 7, 168.0) if tag else None
        ),
    )
    bodies, quality = ("drone_1", "drone_2", "bot"), PictureQuality(exposure_ms=0.0)
    renderer = Renderer(RenderSpec("c", mount, FRONT, boards, "t", bodies, "127.0.0.1", 0, quality))
    states = np.zeros((3, 13))
    states[0, 2], states[1, :3], states[2, :2], states[2, 8] = 1.8, (1.0, 0.4, 0.9), (1.3, -0.4), 0.6
    picture = renderer.render(states)
    for sight in compose_scene(renderer._spec, states).sights:
        if sight.board.body == glare:
            cells = np.column_stack((board.cell_centres(), np.zeros(board.CELLS))) * 0.044
            centres = FRONT.project(sight.optical_from_marker.apply(cells))
            columns, rows = np.meshgrid(np.arange(640), np.arange(360))
            for x, y in centres:
                picture[np.hypot(columns - x, rows - y) < 9.0] = 235
    return picture


def looked_at(picture: np.ndarray, markers: tuple[MarkerSettings, ...], **detector: float) -> tuple[set[str], set[str]]:
    """Return whom a camera reports, and whom else its picture may show."""
    pipeline = Pipeline(FRONT, markers, DetectorSettings(**detector), search_rate_hz=2.0)
    level = pose.Gravity(stabilized_from_optical(MOUNT, 0.0, 0.0), 0.0, 0.0, True)
    for k in range(9):
        sightings = pipeline.process(picture, k * 66_666_667, lambda _: level)
        if pipeline.searched:
            found = {sighting.entity for sighting in sightings}, set(pipeline.unmeasured)
    return found


def test_a_picture_of_readable_boards_leaves_nothing_open() -> None:
    assert looked_at(picture_of(), BOARDS) == ({"bot", "drone_2"}, set())
    assert looked_at(picture_of(), BOARDS[:1]) == ({"drone_2"}, set())


def test_of_two_boards_with_one_code_neither_is_reported_and_their_owner_may_be_there() -> None:
    assert looked_at(picture_of(codes=(5, 5)), BOARDS) == (set(), {"bot"})


def test_a_board_that_cannot_be_read_may_be_that_of_each_who_is_not_seen_elsewhere() -> None:
    both = looked_at(picture_of(glare="bot"), BOARDS)
    assert both == ({"drone_2"}, {"bot"})
    other = MarkerSettings(entity="drone_3", code=1, square_mm=44.0)
    assert looked_at(picture_of(glare="bot"), (*BOARDS, other)) == ({"drone_2"}, {"bot", "drone_3"})
    assert looked_at(picture_of(glare="bot"), (*TAGS, other)) == ({"drone_2"}, {"drone_3"})


@pytest.mark.parametrize("tag", [False, True])
def test_a_sighting_that_its_residual_refuses_was_in_the_picture(tag: bool) -> None:
    found = looked_at(picture_of(tag=tag), TAGS if tag else BOARDS, max_residual_px=1e-3)
    assert found == (set(), {"bot", "drone_2"})


@pytest.mark.parametrize(("glare", "found", "unmeasured"), [("", ("bot",), ()), ("bot", (), ("bot",))])
def test_the_driver_publishes_whom_a_picture_may_show(glare, found, unmeasured):
    exchange = MemoryExchange()
    child, source = FakeChild(MemoryBus(exchange, "lab", "drone_1_camera")), FakeSource()
    heard = MemoryBus(exchange, "lab", "test").subscribe([SEARCHED_PICTURE])
    source.push(cv2.imencode(".jpg", picture_of(codes=(9, 5), glare=glare))[1].tobytes())
    driver.CameraDriver(child, settings(), source).turn()
    (searched,) = [one.message for one in heard.drain() if isinstance(one.message, SearchedPicture)]
    assert (searched.found, searched.unmeasured) == (found, unmeasured)
    assert [searched.may_show(name) for name in ("bot", "drone_2")] == [True, False]

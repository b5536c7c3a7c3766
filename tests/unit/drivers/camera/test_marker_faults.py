"""Faults of prints and of the picture itself: distinguished from chance, and named with the right remedy."""

import math
import re

import numpy as np
import pytest

from drivers.camera import pose
from drivers.camera.convert import stabilized_from_optical
from drivers.camera.faults import MarkerFaults
from drivers.camera.pipeline import Pipeline
from drivers.camera.settings import DetectorSettings, MarkerSettings, MountSettings, TagSettings
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.geometry.tag import SquareTag
from groundstation.time_units import NS_PER_S
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, PictureQuality, RenderSpec

FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5)
MOUNT = MountSettings(parent="drone_1", tilt_down_deg=45.0)
FAMILY = "DICT_4X4_50"
FRAME_NS = 66_666_667
BOARDS = {"drone_2": 2, "bot": 5}
BOARD = MarkerSettings(entity="drone_2", code=2, square_mm=44.0)
TAG = MarkerSettings(entity="bot", tag=TagSettings(dictionary=FAMILY, id=7, size_mm=168.0))


def board_of(entity: str) -> MarkerSettings:
    return MarkerSettings(entity=entity, code=BOARDS[entity], square_mm=44.0)


def renderer_of(code: int = 2, tag_mm: float = 0.0) -> Renderer:
    """Return the picture's source of a camera on drone_1: drone_2 with a board, the target with a tag or a board."""
    mount = Mount(Pose(base_from_tilted_optical(math.radians(45)), np.zeros(3)), "drone_1")
    boards = (
        BoardSpec("drone_2", code, 44.0, (0.0, 0.0, 0.08)),
        BoardSpec(
            "bot", 5, 44.0, (0.0, 0.0, 0.4), BodyShape.TURTLEBOT, SquareTag(FAMILY, 7, tag_mm) if tag_mm else None
        ),
    )
    bodies, quality = ("drone_1", "drone_2", "bot"), PictureQuality(exposure_ms=0.0)
    return Renderer(RenderSpec("c", mount, FRONT, boards, "t", bodies, "127.0.0.1", 0, quality))


def scene(drone_2: tuple[float, float, float] = (1.0, 0.4, 0.9), bot_y: float = -0.4) -> np.ndarray:
    states = np.zeros((3, 13))
    states[0, 2], states[1, :3], states[2, :2], states[2, 8] = 1.8, drone_2, (1.3, bot_y), 0.6
    return states


def told(
    pictures: list[np.ndarray], markers: tuple[MarkerSettings, ...], drop_m: float | None = None
) -> tuple[list[str], Pipeline]:
    """Return what a camera reports of these pictures, each fault in a line, and its detector."""
    pipeline = Pipeline(FRONT, markers, DetectorSettings(), search_rate_hz=2.0)
    level = pose.Gravity(stabilized_from_optical(MOUNT, 0.0, 0.0), 0.0, 0.0, True)
    for k, picture in enumerate(pictures):
        pipeline.process(picture, k * FRAME_NS, lambda _: level, drop_of=lambda _: drop_m)
    return [f"{notice.text}: {notice.remedy}" for notice in pipeline.take_notices()], pipeline


def test_a_code_that_is_misread_now_and_then_is_not_taken_for_a_marker() -> None:
    faults = MarkerFaults()
    for minute in range(20):
        faults.foreign(9, 60 * minute * NS_PER_S, ())
    assert not faults.take()


@pytest.mark.parametrize(("tag_mm", "count"), [(168.0, 0), (140.0, 1)])
def test_a_tag_of_the_wrong_size_is_noticed_by_its_heights(tag_mm: float, count: int) -> None:
    renderer = renderer_of(tag_mm=tag_mm)
    pictures = [renderer.render(scene((9, 9, 1), 0.2 * math.sin(k / 9))) for k in range(60)]
    texts, _ = told(pictures, (TAG,), drop_m=1.8 - 0.4)
    assert len(texts) == count
    if count:
        assert "tag DICT_4X4_50 7 of bot seems 1.2" in texts[0]
        assert re.search("168 mm are set, 1[34][0-9] mm would fit", texts[0])


def test_a_marker_of_nobody_is_not_that_of_a_tags_carrier_in_view() -> None:
    texts, _ = told([renderer_of(code=9, tag_mm=168.0).render(scene())] * 75, (BOARD, TAG))
    (text,) = texts
    assert text.startswith("marker 9 is in view") and "that of drone_2 (" in text and "bot" not in text


def test_a_mirrored_tag_is_named() -> None:
    picture = np.ascontiguousarray(renderer_of(tag_mm=168.0).render(scene((9, 9, 1)))[:, ::-1])
    (text,), pipeline = told([picture] * 130, (TAG,))
    assert text.startswith("the tag DICT_4X4_50 7 of bot is mirrored") and "print it again" in text
    assert pipeline.tracked == ()


def test_other_tags_are_not_taken_for_mirrored_ones() -> None:
    other = TAG.model_copy(update={"tag": TagSettings(dictionary=FAMILY, id=8, size_mm=168.0)})
    texts, _ = told([renderer_of(tag_mm=168.0).render(scene((9, 9, 1)))] * 130, (other,))
    assert texts == []


def test_a_picture_that_mirrors_all_markers_is_not_the_prints_fault() -> None:
    picture = np.ascontiguousarray(renderer_of().render(scene())[:, ::-1])
    texts, _ = told([picture] * 30, tuple(map(board_of, BOARDS)))
    assert "the picture is mirrored: it shows the markers of bot and drone_2 the wrong way round" in texts[-1]
    assert texts[-1].endswith("switch off the camera's flip (its mirror setting)")
    # Of the first of them alone it was not known yet.
    assert all("print it again, not mirrored, or switch off the camera's flip" in text for text in texts[:-1])


def test_a_mirrored_print_among_right_ones_is_the_prints_fault() -> None:
    picture = renderer_of().render(scene())
    picture[:, :320] = renderer_of().render(scene((1.0, -0.4, 0.9), bot_y=9.0))[:, :319:-1]
    both, _ = told([picture] * 30, tuple(map(board_of, BOARDS)))
    assert len(both) == 1 and "is mirrored and cannot be used: print it again, not mirrored" in both[0]
    assert "flip" not in both[0]

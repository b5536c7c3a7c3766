"""Pictures with known truth: one board before a tilted camera at a given distance, steepness and picture quality."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from groundstation.arrays import Array, Image
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical, rotation_from_euler
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.scene import compose_scene
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, PictureQuality, RenderSpec
from sim_bridge.study.vision.coding import through_h264, through_jpeg

FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
SQUARE_MM, TILT_DOWN_DEG, HEIGHT_M, BOARD_M = 44.0, 45.0, 2.2, 0.4
CLEAN = PictureQuality(corner_noise_px=0.0, exposure_ms=0.0)
REAL = PictureQuality(exposure_ms=0.0)
_BORDER_PX = 12.0
_MOST_TRIES = 20_000


@dataclass(frozen=True, slots=True)
class Condition:
    """A picture quality: scenario, smear of the board [px], quality of JPEG or quantiser of H.264."""

    name: str
    scenario: PictureQuality
    smear_px: float = 0.0
    jpeg: int | None = None
    h264: int | None = None


def _conditions() -> tuple[Condition, ...]:
    moving = replace(CLEAN, exposure_ms=10.0)
    return (
        Condition("clean", CLEAN),
        Condition("0.2 px corner noise", REAL),
        Condition("motion blur 3 px", moving, 3.0),
        Condition("motion blur 6 px", moving, 6.0),
        Condition("defocus 1.5 px", replace(CLEAN, blur_px=1.5)),
        Condition("low light", replace(CLEAN, light=0.25, shot_noise=4.0)),
        Condition("very low light", replace(CLEAN, light=0.12, shot_noise=4.0)),
        Condition("noise 8 levels", replace(CLEAN, pixel_noise=8.0)),
        Condition("JPEG 30", CLEAN, jpeg=30),
        Condition("JPEG 10", CLEAN, jpeg=10),
        Condition("H.264 quantiser 30", CLEAN, h264=30),
        Condition("H.264 quantiser 38", CLEAN, h264=38),
        Condition("rolling shutter 20 ms", replace(CLEAN, rolling_shutter_ms=20.0)),
    )


CONDITIONS = _conditions()


@dataclass(frozen=True, slots=True)
class TestPicture:
    """A picture, its code, the true optical_from_marker, states of carrier and subject, true corners [px]."""

    picture: Image
    code: int
    truth: Pose
    states: Array
    corners: Array

    @property
    def centre(self) -> Array:
        """Return the board's centre [m; world]."""
        return self.states[1, :3] + rotation_from_euler(*self.states[1, 6:9]) @ (0.0, 0.0, BOARD_M)


def points() -> Array:
    """Return the corners of the bench's board (12, 3) [m]."""
    return Checkerboard(1, SQUARE_MM).corners()


@cache
def _renderer(condition: Condition, code: int) -> Renderer:
    mount = Mount(Pose(base_from_tilted_optical(math.radians(TILT_DOWN_DEG)), np.zeros(3)), "drone_1")
    board = BoardSpec("bot", code, SQUARE_MM, (0.0, 0.0, BOARD_M), BodyShape.TURTLEBOT)
    return Renderer(
        RenderSpec("drone_1", mount, FRONT, (board,), "", ("drone_1", "bot"), "", 0, condition.scenario, seed=code + 1)
    )


def shots(
    count: int,
    range_m: float,
    condition: Condition,
    seed: int,
    codes: tuple[int, ...] = (5,),
    steepness_deg: tuple[float, float] = (0.0, 60.0),
) -> Iterator[TestPicture]:
    """Yield pictures with the whole board in view, anywhere in the picture, any heading, tilted by about 4 deg.

    steepness_deg: angle between the board's normal and the line of sight.
    """
    random = np.random.default_rng([seed, round(100 * range_m)])
    found = 0
    for _ in range(_MOST_TRIES):
        if found == count:
            return
        renderer = _renderer(condition, codes[found % len(codes)])
        shot = _shot(renderer, range_m, condition, random, codes[found % len(codes)], steepness_deg)
        if shot is not None:
            found += 1
            yield shot


def _shot(
    renderer: Renderer,
    range_m: float,
    condition: Condition,
    random: np.random.Generator,
    code: int,
    steepness_deg: tuple[float, float],
) -> TestPicture | None:
    spec, states = renderer.spec, np.zeros((2, 13))
    states[0, 2], states[0, 8] = HEIGHT_M, random.uniform(-math.pi, math.pi)
    wide = steepness_deg[1] > 60.0
    states[0, 6:8] = random.normal(0.0, 0.25 if wide else 0.05, 2)
    camera = compose_scene(spec, states).world_from_optical
    ray = np.array([random.uniform(-0.45, 0.45), random.uniform(-0.28, 0.28), 1.0])
    states[1, 6:9] = *random.normal(0.0, 0.6 if wide else 0.07, 2), random.uniform(-math.pi, math.pi)
    centre = camera.apply(ray * range_m / np.linalg.norm(ray))
    states[1, :3] = centre - rotation_from_euler(*states[1, 6:9]) @ (0.0, 0.0, BOARD_M)
    truth = compose_scene(spec, states).sights[0].optical_from_marker
    sight = truth.translation / np.linalg.norm(truth.translation)
    steepness = math.degrees(math.acos(float(np.clip(-truth.rotation[:, 2] @ sight, -1.0, 1.0))))
    card = FRONT.project(truth.apply(Checkerboard(code, SQUARE_MM).outline()))
    if not steepness_deg[0] <= steepness <= steepness_deg[1] or not FRONT.contains(card, _BORDER_PX).all():
        return None
    if condition.smear_px:
        along = camera.rotation[:, 0] * math.cos(states[0, 8]) + camera.rotation[:, 1] * math.sin(states[0, 8])
        seconds = condition.scenario.exposure_ms / 1000.0
        states[1, 3:6] = along * condition.smear_px * truth.translation[2] / FRONT.fx_px / seconds
    if condition.scenario.rolling_shutter_ms:
        states[1, 3:6] = 0.5 * camera.rotation[:, 0]
    picture = renderer.render(states)
    if condition.jpeg is not None:
        picture = through_jpeg(picture, condition.jpeg)
    if condition.h264 is not None:
        picture = through_h264(picture, condition.h264)
    return TestPicture(picture, code, truth, states, FRONT.project(truth.apply(points())))

"""Measures the CPU load of a whole team's cameras: pictures are rendered and coded, then decoded and detected."""

import math
from functools import partial
from typing import Any

import cv2
import numpy as np

from drivers.camera.convert import stabilized_from_optical
from drivers.camera.pipeline import Pipeline
from drivers.camera.pose import Gravity
from drivers.camera.prediction import Foresight, Predictions
from drivers.camera.settings import DetectorSettings, MarkerKind, MarkerSettings, MountSettings
from groundstation.bus.messages import EntityEstimate, Estimate, Header
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, PictureQuality, RenderSpec
from sim_bridge.study.vision.measure import cpu_ms
from sim_bridge.study.vision.scenes import BOARD_M, FRONT, SQUARE_MM

CEILING = CameraIntrinsics(1280, 720, 1179.0, 1179.0, 639.5, 359.5, (-0.12, 0.05, 0.0, 0.0, 0.0))
_DRONES = ("drone_1", "drone_2", "drone_3")
_BODIES = (*_DRONES, "bot")
_FPS = 15.0
_TOP_M = 0.08
# Correlation of the belief's errors from one picture to the next: they last for a second.
_MEMORY = 0.935


def _boards() -> tuple[BoardSpec, ...]:
    robots = tuple(BoardSpec(name, code, SQUARE_MM, (0.0, 0.0, _TOP_M)) for code, name in enumerate(_DRONES, start=1))
    return (*robots, BoardSpec("bot", 5, SQUARE_MM, (0.0, 0.0, BOARD_M), BodyShape.TURTLEBOT))


def _states(seconds: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return true states: three drones about a robot that drives in a circle, swaying as drones do."""
    states = np.zeros((len(_BODIES), 13))
    states[3, :3] = (0.8 * math.cos(0.25 * seconds), 0.8 * math.sin(0.25 * seconds), 0.0)
    states[3, 8] = 0.25 * seconds + math.pi / 2
    for k in range(3):
        bearing = 2.1 * k + 0.1 * seconds
        away, height = (1.5, 1.4 + 0.4 * k)
        states[k, :3] = (
            states[3, 0] - away * math.cos(bearing),
            states[3, 1] - away * math.sin(bearing),
            height + 0.05 * math.sin(2.0 * seconds + k),
        )
        states[k, 6:9] = (0.05 * math.sin(3.0 * seconds + k), 0.05 * math.cos(2.6 * seconds + k), bearing)
    return states


class _Camera:
    """One camera of the team, from the true states to sightings."""

    def __init__(self, name: str, seed: int) -> None:
        carried = name in _DRONES
        tilt = base_from_tilted_optical(math.radians(45.0))
        world = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 4.2]))
        lens = FRONT if carried else CEILING
        mount = Mount(Pose(tilt, np.array([0.09, 0.0, 0.0])), name) if carried else Mount(world)
        spec = RenderSpec(name, mount, lens, _boards(), "", _BODIES, "", 0, PictureQuality(), seed)
        self._renderer, self._name, self._carried = Renderer(spec), name, carried
        self._mount = (
            MountSettings(parent=name, position_m=(0.09, 0.0, 0.0), tilt_down_deg=45.0)
            if carried
            else MountSettings(parent="world", position_m=(0.0, 0.0, 4.2), looking="down")
        )
        markers = tuple(
            MarkerSettings(
                entity=board.body,
                code=board.code,
                square_mm=SQUARE_MM,
                position_m=board.position_m,
                kind=MarkerKind.TARGET if board.body == "bot" else MarkerKind.ROBOT,
            )
            for board in _boards()
            if board.body != name and (carried or board.body != "bot")
        )
        self._pipeline = Pipeline(lens, markers, DetectorSettings(), 2.0, 0.1 * seed)
        self._foresight = Foresight(self._mount, name, markers, lens)
        self.sightings = 0

    def render(self, states: Any) -> bytes:
        picture = self._renderer.render(states)
        return bytes(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 85])[1])

    def detect(self, jpeg: bytes, states: Any, stamp_ns: int, estimate: Estimate) -> None:
        picture = np.asarray(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE), np.uint8)
        attitude = tuple(states[_BODIES.index(self._name), 6:8]) if self._carried else (0.0, 0.0)
        self._foresight.add(estimate)
        predictions: Predictions = self._foresight.at(stamp_ns, attitude)
        rotation = stabilized_from_optical(self._mount, *attitude)
        known = {name: (float(row[6]), float(row[7])) for name, row in zip(_BODIES, states, strict=True)}
        seen = self._pipeline.process(
            picture, stamp_ns, lambda entity: Gravity(rotation, *known[entity], True), predictions
        )
        self.sightings += len(seen)


def _estimate(states: Any, stamp_ns: int, errors: Any, random: np.random.Generator) -> Estimate:
    """Return a belief whose errors (n, 3) [m] change slowly, as those of an estimator do."""
    errors *= _MEMORY
    errors += random.normal(0.0, 0.03 * math.sqrt(1.0 - _MEMORY**2), errors.shape)
    entities = []
    for name, row, error in zip(_BODIES, states, errors, strict=True):
        place = row[:3] + error
        if name == "bot":
            flat = (0.03**2, 0.0, 0.0, 0.03**2)
            entities.append(EntityEstimate(name, "target", tuple(place[:2].tolist()), flat, (0.0, 0.0), True, 0.1))
        else:
            covariance = tuple(np.diag([0.03**2] * 3 + [0.02**2]).ravel().tolist())
            mean = (*place.tolist(), float(row[8]))
            entities.append(EntityEstimate(name, "robot", mean, covariance, (0.0, 0.0, 0.0), True, 0.1))
    return Estimate(header=Header(stamp_ns, "bench", "tracker", "tracker", 0), entities=tuple(entities), epoch=1)


def team_load(seconds: float) -> dict[str, float]:
    """Return the cores that three drones' cameras and a ceiling camera need at 15 fps, without sockets and bus."""
    cameras = [_Camera(name, seed) for seed, name in enumerate((*_DRONES, "ceiling"))]
    random, errors = np.random.default_rng(1), np.zeros((len(_BODIES), 3))
    spent = {"render": 0.0, "detect": 0.0}
    frames = max(1, round(seconds * _FPS))
    for frame in range(frames):
        states, stamp_ns = _states(frame / _FPS), round(1e9 * frame / _FPS)
        estimate = _estimate(states, stamp_ns, errors, random)
        for camera in cameras:
            ms, jpeg = cpu_ms(partial(camera.render, states))
            spent["render"] += ms
            spent["detect"] += cpu_ms(partial(camera.detect, jpeg, states, stamp_ns, estimate))[0]
    cores = {f"{name}_cores": ms / 1000.0 / (frames / _FPS) for name, ms in spent.items()}
    return {**cores, "cores": sum(cores.values()), "sightings_per_frame": sum(c.sightings for c in cameras) / frames}

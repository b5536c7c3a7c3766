"""Where the pictures of a camera go: MJPEG over HTTP, or the video port of an AR.Drone."""

import math
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Protocol

import cv2
import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.time_units import NS_PER_MS
from sim_bridge.devices.ardrone_video import ArDroneVideoServer, VideoEncoder, VideoMode
from sim_bridge.devices.camera_stream import CameraStream
from sim_bridge.render.spec import Mount, RenderSpec, StreamKind
from sim_bridge.render.wrong_pictures import WrongPictures

# The drone was switched on a little before the world began.
_POWER_ON_MS = 20_000
# WIRE (docs/reference/ardrone.md 6): calibration of a real bottom camera, 320x240 enlarged to 640x360.
_BOTTOM_LENS = CameraIntrinsics(640, 360, 700.5, 701.7, 319.5, 218.7)
_BOTTOM_M = (0.0, 0.0, -0.03)


class Output(Protocol):
    """What a camera's loop needs of its output."""

    @property
    def clients(self) -> int:
        """Return how many are looking."""

    def set_accepting(self, accepting: bool) -> None:
        """Cut all clients and refuse new ones (False), or serve (True)."""

    def show(self, states: Array, exposure_ns: int, release_ns: int, now_s: float) -> None:
        """Draw the true states and send the picture at a time [ns]; now_s: since the first true state."""

    def close(self) -> None:
        """Stop serving."""


def open_output(spec: RenderSpec, modes: Connection | None) -> Output:
    """Return the output of a camera; modes: what an AR.Drone is told of its video, as it comes."""
    return ArDroneOutput(spec, modes) if spec.kind is StreamKind.ARDRONE else MjpegOutput(spec)


class MjpegOutput:
    """JPEGs over HTTP."""

    def __init__(self, spec: RenderSpec) -> None:
        self._quality = (cv2.IMWRITE_JPEG_QUALITY, spec.scenario.jpeg_quality)
        self._renderer = WrongPictures(spec)
        self._stream = CameraStream(spec.address, spec.port)
        self.set_accepting = self._stream.set_accepting
        self.close = self._stream.close

    @property
    def clients(self) -> int:
        """Return how many are looking."""
        return self._stream.clients

    def show(self, states: Array, exposure_ns: int, release_ns: int, now_s: float) -> None:
        """Draw the true states and send the picture at a time [ns]; now_s: since the first true state."""
        jpeg = cv2.imencode(".jpg", self._renderer.render(states, now_s), self._quality)[1].tobytes()
        self._stream.send_at(release_ns, jpeg)


class ArDroneOutput:
    """H.264 over TCP, of the camera and in the size that the drone's configuration asks for."""

    def __init__(self, spec: RenderSpec, modes: Connection | None) -> None:
        self._spec, self._modes = spec, modes
        self._renderers: dict[tuple[bool, tuple[int, int]], WrongPictures] = {}
        self._encoder = VideoEncoder(VideoMode(), spec.scenario.fps, spec.video_header_bytes)
        self._renderer = self._renderer_of(VideoMode())
        self._first_ns = 0
        self._server = ArDroneVideoServer(spec.address, spec.port)
        self.set_accepting = self._server.set_accepting
        self.close = self._server.close

    @property
    def clients(self) -> int:
        """Return how many are looking."""
        return self._server.clients

    def show(self, states: Array, exposure_ns: int, release_ns: int, now_s: float) -> None:
        """Draw the true states and send the picture at a time [ns]; now_s: since the first true state."""
        self._follow_configuration()
        self._first_ns = self._first_ns or exposure_ns
        timestamp_ms = _POWER_ON_MS + (exposure_ns - self._first_ns) // NS_PER_MS
        picture = self._renderer.render(states, now_s)
        encoded = self._encoder.encode(picture, timestamp_ms, want_idr=self._server.take_newcomers())
        self._server.send_at(release_ns, encoded)

    def _follow_configuration(self) -> None:
        mode = self._encoder.mode
        while self._modes is not None and self._modes.poll():
            try:
                mode = VideoMode(*self._modes.recv())
            except EOFError:
                self._modes = None
        if mode != self._encoder.mode:
            spec, before = self._spec, self._encoder
            self._encoder = VideoEncoder(
                mode, spec.scenario.fps, spec.video_header_bytes, before.number, before.position
            )
            self._renderer = self._renderer_of(mode)

    def _renderer_of(self, mode: VideoMode) -> WrongPictures:
        key = mode.bottom, mode.size
        if key not in self._renderers:
            self._renderers[key] = WrongPictures(_shown(self._spec, mode))
        return self._renderers[key]


def _shown(spec: RenderSpec, mode: VideoMode) -> RenderSpec:
    if not mode.bottom:
        return replace(spec, intrinsics=scaled(spec.intrinsics, mode.size))
    mount = Mount(Pose(base_from_tilted_optical(math.radians(90.0)), np.array(_BOTTOM_M)), spec.mount.body)
    return replace(spec, mount=mount, intrinsics=scaled(_BOTTOM_LENS, mode.size))


def scaled(lens: CameraIntrinsics, size: tuple[int, int]) -> CameraIntrinsics:
    """Return the same lens for pictures of another size."""
    x, y = size[0] / lens.width_px, size[1] / lens.height_px
    if (x, y) == (1.0, 1.0):
        return lens
    # Pixel centres are at whole numbers: the picture's corner is at -0.5.
    cx, cy = (lens.cx_px + 0.5) * x - 0.5, (lens.cy_px + 0.5) * y - 0.5
    return CameraIntrinsics(*size, lens.fx_px * x, lens.fy_px * y, cx, cy, lens.distortion)

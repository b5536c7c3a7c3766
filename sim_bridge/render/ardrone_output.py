"""Draws an AR.Drone's own video and serves it at its video port."""

import math
from dataclasses import replace
from multiprocessing.connection import Connection

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.time_units import NS_PER_MS
from sim_bridge.devices.ardrone_video import ArDroneVideoServer, VideoEncoder
from sim_bridge.devices.ardrone_video_mode import VideoMode
from sim_bridge.own_video import OwnVideo
from sim_bridge.render.outputs import scaled
from sim_bridge.render.spec import Mount, RenderSpec
from sim_bridge.render.wrong_pictures import WrongPictures

# The drone was switched on a little before the simulation began.
_POWER_ON_MS = 20_000
# WIRE (docs/reference/ardrone.md 6): calibration of a real bottom camera, 320x240 enlarged to 640x360.
_BOTTOM_LENS = CameraIntrinsics(640, 360, 700.5, 701.7, 319.5, 218.7)
_BOTTOM_M = (0.0, 0.0, -0.03)
_HEADER_BYTES = 68


def header_bytes_of(own: OwnVideo | None) -> int:
    """Return the size of the header of each frame, as the firmware has it."""
    given = own.options.get("header_bytes") if own is not None else None
    return given if isinstance(given, int) else _HEADER_BYTES


class ArDroneOutput:
    """H.264 over TCP, of the camera and size that the drone's configuration selects."""

    def __init__(self, spec: RenderSpec, modes: Connection | None) -> None:
        self._spec, self._modes = spec, modes
        self._header_bytes = header_bytes_of(spec.own)
        self._renderers: dict[tuple[bool, tuple[int, int]], WrongPictures] = {}
        self._encoder = VideoEncoder(VideoMode(), spec.scenario.fps, self._header_bytes)
        self._renderer = self._renderer_of(VideoMode())
        self._first_ns = 0
        self._server = ArDroneVideoServer(spec.address, spec.port)
        self.set_accepting = self._server.set_accepting
        self.close = self._server.close

    @property
    def clients(self) -> int:
        """Return the number of clients."""
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
            self._encoder = VideoEncoder(mode, spec.scenario.fps, self._header_bytes, before.number, before.position)
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

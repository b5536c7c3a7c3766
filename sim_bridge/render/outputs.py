"""Outputs of a camera's pictures: MJPEG over HTTP, or the own video of the vehicle that carries it."""

from multiprocessing.connection import Connection
from pkgutil import resolve_name
from typing import Protocol

import cv2

from groundstation.arrays import Array
from groundstation.geometry.lens import CameraIntrinsics
from sim_bridge.devices.camera_stream import CameraStream
from sim_bridge.render.spec import RenderSpec
from sim_bridge.render.wrong_pictures import WrongPictures


class Output(Protocol):
    """The interface of an output to a camera's loop."""

    @property
    def clients(self) -> int:
        """Return how many are looking."""

    def set_accepting(self, accepting: bool) -> None:
        """Disconnect all clients and refuse new ones (False), or serve (True)."""

    def show(self, states: Array, exposure_ns: int, release_ns: int, now_s: float) -> None:
        """Draw the true states and send the picture at a time [ns]; now_s: since the first true state."""

    def close(self) -> None:
        """Stop serving."""


def open_output(spec: RenderSpec, modes: Connection | None) -> Output:
    """Return the output of a camera; modes: settings of a vehicle's own video, as they change."""
    if spec.own is None:
        return MjpegOutput(spec)
    output: Output = resolve_name(spec.own.output)(spec, modes)
    return output


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


def scaled(lens: CameraIntrinsics, size: tuple[int, int]) -> CameraIntrinsics:
    """Return the same lens for pictures of another size."""
    x, y = size[0] / lens.width_px, size[1] / lens.height_px
    if (x, y) == (1.0, 1.0):
        return lens
    # Pixel centres are at whole numbers: the picture's corner is at -0.5.
    cx, cy = (lens.cx_px + 0.5) * x - 0.5, (lens.cy_px + 0.5) * y - 0.5
    return CameraIntrinsics(*size, lens.fx_px * x, lens.fy_px * y, cx, cy, lens.distortion)

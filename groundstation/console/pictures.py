"""The newest picture of each camera, and what was detected in exactly that picture."""

import math
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from groundstation.bus.messages import Header, RelativeObservation
from groundstation.geometry.lens import CameraIntrinsics

# Half of the board's long side, quiet zone included [m]: the ring that is drawn around a detection.
_RING_M = 0.16
_REMEMBERED = 8
# Pictures come at 5 a second at most; a sender that does not keep to it is held to it here.
_PERIOD_NS = 190_000_000


class PictureDesk:
    """Keeps one picture per camera. Detections come before or after their picture, and belong to it by their stamp."""

    def __init__(self, lenses: Mapping[str, CameraIntrinsics]) -> None:
        self._lenses = lenses
        self._stamps: dict[str, int] = {}
        self._taken: dict[str, int] = {}
        self._seen: dict[str, dict[int, list[dict[str, Any]]]] = {}
        self.frames: dict[str, bytes] = {}

    def take_picture(self, camera: str, header: Header, jpeg: bytes, now_ns: int) -> bool:
        """Keep a picture; returns whether it is to be shown. Its frame for viewers is in `frames`."""
        if now_ns - self._taken.get(camera, 0) < _PERIOD_NS or not jpeg.startswith(b"\xff\xd8"):
            return False
        self._taken[camera], self._stamps[camera] = now_ns, header.stamp_ns
        self.frames[camera] = frame_of(camera, header.stamp_ns, jpeg)
        return True

    def take_detection(self, observation: RelativeObservation) -> None:
        """Keep where in the picture a marker was."""
        lens = self._lenses.get(observation.camera)
        if lens is None:
            return
        x, y, z = observation.position_m
        pixel = lens.project(np.array([x, y, z]))
        if not math.isfinite(pixel[0]):
            return
        by_stamp = self._seen.setdefault(observation.camera, {})
        mark = {
            "subject": observation.subject,
            "u": round(float(pixel[0]), 1),
            "v": round(float(pixel[1]), 1),
            "r": round(lens.fx_px * _RING_M / z, 1),
            "range_m": round(math.sqrt(x * x + y * y + z * z), 2),
        }
        by_stamp.setdefault(observation.header.stamp_ns, []).append(mark)
        while len(by_stamp) > _REMEMBERED:
            del by_stamp[next(iter(by_stamp))]

    def detections(self) -> dict[str, Any]:
        """Return the marks of each camera's newest picture."""
        return {
            camera: {
                "stamp_ms": stamp / 1e6,
                "width": lens.width_px,
                "height": lens.height_px,
                "marks": self._seen.get(camera, {}).get(stamp, []),
            }
            for camera, stamp in self._stamps.items()
            if (lens := self._lenses.get(camera)) is not None
        }


def frame_of(camera: str, stamp_ns: int, jpeg: bytes) -> bytes:
    """Return a binary frame: length of the head (2 bytes, big endian), head as JSON, JPEG."""
    head = msgspec.json.encode({"camera": camera, "stamp_ms": stamp_ns / 1e6})
    return len(head).to_bytes(2, "big") + head + jpeg

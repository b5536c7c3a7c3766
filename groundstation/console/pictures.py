"""The newest picture of each camera, with the detections of exactly that picture."""

import math
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from groundstation.bus.jpeg import stated_size
from groundstation.bus.messages import Header, RelativeObservation
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.time_units import NS_PER_MS

# Half of the board's long side, quiet zone included [m]: radius of the ring around a detection.
_RING_M = 0.16
_REMEMBERED = 8
# Pictures come at 5 a second at most; faster senders are limited to this on average: arrivals are checked in turns of
# 50 ms.
_PERIOD_NS = 200 * NS_PER_MS
_EARLY_NS = 60 * NS_PER_MS
# A browser decodes whatever it gets: 20 megapixels are 80 MB there.
_MAX_BYTES = 4_000_000
_MAX_PIXELS = 20_000_000


class PictureDesk:
    """Keeps one picture per camera. Detections come before or after their picture, and belong to it by their stamp."""

    def __init__(self, lenses: Mapping[str, CameraIntrinsics]) -> None:
        self._lenses = lenses
        self._stamps: dict[str, int] = {}
        self._due: dict[str, int] = {}
        self._seen: dict[str, dict[int, list[RelativeObservation]]] = {}
        self._marks: dict[str, list[dict[str, Any]]] = {}
        self.frames: dict[str, bytes] = {}
        self.refused: dict[str, str] = {}

    def take_picture(self, camera: str, header: Header, jpeg: bytes, now_ns: int) -> bool:
        """Keep a picture; returns whether to show it. Its frame for viewers is in `frames`.

        `refused` has the reason if the newest of a camera is not shown.
        """
        due_ns = self._due.get(camera, 0)
        if now_ns < due_ns - _EARLY_NS:
            return False
        self._due[camera] = max(due_ns, now_ns - _EARLY_NS) + _PERIOD_NS
        problem = problem_of(jpeg)
        if problem:
            self.refused[camera] = problem
            return False
        self.refused.pop(camera, None)
        stamp_ns = self._stamps[camera] = header.stamp_ns
        self.frames[camera] = frame_of(camera, stamp_ns, jpeg)
        found = self._seen.get(camera, {}).get(stamp_ns, [])
        self._marks[camera] = [mark for observation in found for mark in self._marks_of(observation)]
        return True

    def take_detection(self, observation: RelativeObservation) -> None:
        """Keep a marker's place in the picture."""
        camera, stamp_ns = observation.camera, observation.header.stamp_ns
        if camera not in self._lenses:
            return
        if self._stamps.get(camera) == stamp_ns:
            self._marks[camera] += self._marks_of(observation)
            return
        by_stamp = self._seen.setdefault(camera, {})
        by_stamp.setdefault(stamp_ns, []).append(observation)
        while len(by_stamp) > _REMEMBERED:
            del by_stamp[next(iter(by_stamp))]

    def detections(self) -> dict[str, Any]:
        """Return the marks of each camera's newest picture."""
        return {
            camera: {
                "stamp_ms": stamp / 1e6,
                "width": lens.width_px,
                "height": lens.height_px,
                "marks": self._marks[camera],
            }
            for camera, stamp in self._stamps.items()
            if (lens := self._lenses.get(camera)) is not None
        }

    def _marks_of(self, observation: RelativeObservation) -> list[dict[str, Any]]:
        lens = self._lenses.get(observation.camera)
        if lens is None:
            return []
        x, y, z = observation.position_m
        pixel = lens.project(np.array([x, y, z]))
        if not math.isfinite(pixel[0]):
            return []
        mark = {
            "subject": observation.subject,
            "u": round(float(pixel[0]), 1),
            "v": round(float(pixel[1]), 1),
            "r": round(lens.fx_px * _RING_M / z, 1),
            "range_m": round(math.sqrt(x * x + y * y + z * z), 2),
        }
        return [mark]


def problem_of(jpeg: bytes) -> str:
    """Return "" for a JPEG fit for a browser, else its fault; checks its head only."""
    if len(jpeg) > _MAX_BYTES:
        return f"picture of {len(jpeg) / 1e6:.0f} MB, at most {_MAX_BYTES / 1e6:.0f} MB are shown"
    size = stated_size(jpeg)
    if size is None:
        return "not a JPEG picture"
    width, height = size
    if not 0 < width * height <= _MAX_PIXELS:
        return f"picture of {width} x {height} pixels, at most {_MAX_PIXELS // 10**6} million are shown"
    return ""


def frame_of(camera: str, stamp_ns: int, jpeg: bytes) -> bytes:
    """Return a binary frame: length of the head (2 bytes, big endian), head as JSON, JPEG."""
    head = msgspec.json.encode({"camera": camera, "stamp_ms": stamp_ns / 1e6})
    return len(head).to_bytes(2, "big") + head + jpeg

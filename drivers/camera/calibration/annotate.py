"""Draws detections into pictures, for people."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array, Image
from groundstation.geometry.lens import CameraIntrinsics

Colour = tuple[int, int, int]

GOOD: Colour = (80, 220, 80)
BAD: Colour = (60, 60, 240)
NOTE: Colour = (230, 200, 60)
_AXES: tuple[Colour, ...] = ((60, 60, 240), (80, 220, 80), (240, 120, 60))
_SHADE: Colour = (0, 0, 0)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def canvas(grey: NDArray[np.uint8]) -> Image:
    """Return a colour copy (h, w, 3) to draw on."""
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def dots(on: Image, corners: Array, colour: Colour) -> None:
    """Draw corners (n, 2) [px], the first of them with a ring."""
    for point in corners:
        cv2.circle(on, _pixel(point), 2, colour, -1, cv2.LINE_AA)
    if len(corners):
        cv2.circle(on, _pixel(corners[0]), 7, colour, 1, cv2.LINE_AA)


def outline(on: Image, corners: Array, colour: Colour) -> None:
    """Draw a closed line through points (n, 2) [px]."""
    cv2.polylines(on, [np.rint(corners).astype(np.int32)], True, colour, 1, cv2.LINE_AA)


def axes(on: Image, rotation: Array, translation: Array, length_m: float, lens: CameraIntrinsics) -> None:
    """Draw a marker's axes, x red, y green, z blue; optical_from_marker is given."""
    ends = lens.project(np.vstack((np.zeros(3), np.eye(3) * length_m)) @ rotation.T + translation)
    if not np.isfinite(ends).all():
        return
    for end, colour in zip(ends[1:], _AXES, strict=True):
        cv2.line(on, _pixel(ends[0]), _pixel(end), colour, 2, cv2.LINE_AA)


def label(on: Image, text: str, place: Sequence[float], colour: Colour) -> None:
    """Write a line of text with its lower left at a place [px]."""
    left, low = int(np.clip(place[0], 2, on.shape[1] - 20)), int(np.clip(place[1], 12, on.shape[0] - 4))
    for shade, width in ((_SHADE, 3), (colour, 1)):
        cv2.putText(on, text, (left, low), _FONT, 0.45, shade, width, cv2.LINE_AA)


def lines(on: Image, texts: Iterable[str], colour: Colour = NOTE) -> None:
    """Write lines of text from the top left corner downwards."""
    for row, text in enumerate(texts):
        label(on, text, (6, 16 + 17 * row), colour)


def jpeg_of(picture: Image) -> bytes:
    """Return a picture as JPEG."""
    return cv2.imencode(".jpg", picture, (cv2.IMWRITE_JPEG_QUALITY, 90))[1].tobytes()


def save(folder: Path, name: str, picture: Image) -> Path:
    """Write a picture as JPEG below a folder; raises OSError, which names the file, if it cannot be written."""
    path = folder / f"{Path(name).stem.replace(' ', '_')}.jpg"
    path.write_bytes(jpeg_of(picture))
    return path


def _pixel(point: Array) -> tuple[int, int]:
    x, y = np.clip(np.rint(point), -30000, 30000).astype(int).tolist()
    return x, y

"""Annotations of camera pictures for viewers: the lens, and a mark for each body seen. Pure.

WIRE (foxglove/schemas, proto): names and numbers of the fields of CameraCalibration and ImageAnnotations.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from groundstation.appearance.colours import NEUTRAL_COLOUR, Colour, rgb
from groundstation.geometry.lens import LensFigures, intrinsics_of
from groundstation.recording.protobuf import Kind, ProtobufField, Type, blob, double, fixed32
from groundstation.vectors import Vector3

CALIBRATION_PREFIX, ANNOTATIONS_PREFIX = "/calibration/", "/annotations/"
PICTURE_PREFIXES = (CALIBRATION_PREFIX, ANNOTATIONS_PREFIX)
_STAMP = ".google.protobuf.Timestamp"
_DIAMETER_PX, _LINE_PX, _FONT_PX = 24.0, 3.0, 16.0


def _fields(*names: str, kind: Kind, first: int = 1, repeated: bool = False, of: str = "") -> tuple[ProtobufField, ...]:
    return tuple(ProtobufField(name, first + place, kind, of, repeated) for place, name in enumerate(names))


def _stamped(number: int = 1) -> ProtobufField:
    return ProtobufField("timestamp", number, Kind.MESSAGE, _STAMP)


CALIBRATION = (
    Type(
        "foxglove",
        "CameraCalibration",
        (
            _stamped(),
            *_fields("width", "height", kind=Kind.FIXED32, first=2),
            ProtobufField("distortion_model", 4, Kind.STRING),
            *_fields("D", "K", "R", "P", kind=Kind.DOUBLE, first=5, repeated=True),
            ProtobufField("frame_id", 9, Kind.STRING),
        ),
    ),
)
ANNOTATIONS = (
    Type("foxglove", "Point2", _fields("x", "y", kind=Kind.DOUBLE)),
    Type("foxglove", "Color", _fields("r", "g", "b", "a", kind=Kind.DOUBLE)),
    Type(
        "foxglove",
        "CircleAnnotation",
        (
            _stamped(),
            *_fields("position", kind=Kind.MESSAGE, first=2, of=".foxglove.Point2"),
            *_fields("diameter", "thickness", kind=Kind.DOUBLE, first=3),
            *_fields("fill_color", "outline_color", kind=Kind.MESSAGE, first=5, of=".foxglove.Color"),
        ),
    ),
    Type(
        "foxglove",
        "TextAnnotation",
        (
            _stamped(),
            *_fields("position", kind=Kind.MESSAGE, first=2, of=".foxglove.Point2"),
            *_fields("text", kind=Kind.STRING, first=3),
            *_fields("font_size", kind=Kind.DOUBLE, first=4),
            *_fields("text_color", kind=Kind.MESSAGE, first=5, of=".foxglove.Color"),
        ),
    ),
    Type(
        "foxglove",
        "ImageAnnotations",
        (
            *_fields("circles", kind=Kind.MESSAGE, repeated=True, of=".foxglove.CircleAnnotation"),
            *_fields("texts", kind=Kind.MESSAGE, first=3, repeated=True, of=".foxglove.TextAnnotation"),
            _stamped(5),
        ),
    ),
)


def calibration(stamp: bytes, camera: str, lens: LensFigures) -> bytes:
    """Return a CameraCalibration; stamp: a protobuf Timestamp, camera: its frame and that of its pictures."""
    matrix = (lens.fx_px, 0.0, lens.cx_px, 0.0, lens.fy_px, lens.cy_px, 0.0, 0.0, 1.0)
    projection = (*matrix[:3], 0.0, *matrix[3:6], 0.0, *matrix[6:], 0.0)
    unturned = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    rows = zip(range(5, 9), (lens.distortion, matrix, unturned, projection), strict=True)
    numbers = b"".join(double(number, value) for number, values in rows for value in values)
    size = fixed32(2, lens.width_px) + fixed32(3, lens.height_px)
    return blob(1, stamp) + size + blob(4, b"plumb_bob") + numbers + blob(9, camera.encode())


def annotations(stamp: bytes, lens: LensFigures, seen: Mapping[str, Vector3], colours: Mapping[str, Colour]) -> bytes:
    """Return ImageAnnotations with a circle and the name of each body in its colour.

    seen: places of markers [m; optical].
    """
    lens_model = intrinsics_of(lens)
    pixels = {name: lens_model.project(np.array(place)) for name, place in seen.items()}
    shown = {name: pixel for name, pixel in pixels.items() if np.isfinite(pixel).all()}
    shades = {name: _shade(colours.get(name, NEUTRAL_COLOUR)) for name in shown}
    circles = (
        blob(1, blob(1, stamp) + _point(pixel) + double(3, _DIAMETER_PX) + double(4, _LINE_PX) + blob(6, shades[name]))
        for name, pixel in shown.items()
    )
    texts = (
        blob(3, blob(1, stamp) + _point(pixel + _DIAMETER_PX) + blob(3, name.encode()) + double(4, _FONT_PX)
             + blob(5, shades[name]))
        for name, pixel in shown.items()
    )  # fmt: skip
    return b"".join((*circles, *texts, blob(5, stamp)))


def _shade(colour: Colour) -> bytes:
    red, green, blue = rgb(colour.dark)
    return b"".join(double(number, value / 255) for number, value in enumerate((red, green, blue, 255), 1))


def _point(pixel: Iterable[float]) -> bytes:
    x, y = pixel
    return blob(2, double(1, float(x)) + double(2, float(y)))

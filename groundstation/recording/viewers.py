"""Messages in types that viewers know: well-known Foxglove types, in protobuf.

WIRE (foxglove/schemas, proto): names and numbers of the fields below. Pictures carry our header in a field of our own.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from itertools import starmap

from groundstation.recording.protobuf import Kind, ProtobufField, Type, blob, descriptor_set, double, fields, integer
from groundstation.recording.viewer_pictures import ANNOTATIONS, CALIBRATION, PICTURE_PREFIXES
from groundstation.time_units import NS_PER_S

TF_CHANNEL = "/tf"
LOG_CHANNEL = "/log"
SCENE_CHANNEL = "/scene"
TRAJECTORY_PREFIX = "/trajectory/"
# Derived from messages that are recorded on their own channels too; our reader skips them.
_CHANNELS = frozenset((TF_CHANNEL, LOG_CHANNEL, SCENE_CHANNEL))

_HEADER_FIELD = 1000
_STAMP = ".google.protobuf.Timestamp"
_TIMESTAMP = Type(
    "google.protobuf", "Timestamp", (ProtobufField("seconds", 1, Kind.INT64), ProtobufField("nanos", 2, Kind.INT32))
)


def _doubles(name: str, names: str) -> Type:
    return Type(
        "foxglove", name, tuple(ProtobufField(one, number + 1, Kind.DOUBLE) for number, one in enumerate(names))
    )


def _picture(name: str, data: int, kind: int, frame: int) -> Type:
    parts = (("data", data, Kind.BYTES), ("format", kind, Kind.STRING), ("frame_id", frame, Kind.STRING))
    ours = ProtobufField("skein_header", _HEADER_FIELD, Kind.STRING)
    return Type(
        "foxglove", name, (ProtobufField("timestamp", 1, Kind.MESSAGE, _STAMP), *starmap(ProtobufField, parts), ours)
    )


_IMAGE = _picture("CompressedImage", data=2, kind=3, frame=4)
_VIDEO = _picture("CompressedVideo", data=3, kind=4, frame=2)
_LEVELS = ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL")
_LOG = Type(
    "foxglove",
    "Log",
    (
        ProtobufField("timestamp", 1, Kind.MESSAGE, _STAMP),
        ProtobufField("level", 2, Kind.ENUM, ".foxglove.Log.Level"),
        ProtobufField("message", 3, Kind.STRING),
        ProtobufField("name", 4, Kind.STRING),
        ProtobufField("file", 5, Kind.STRING),
        ProtobufField("line", 6, Kind.FIXED32),
    ),
    ("Level", _LEVELS),
)
_TRANSFORM = Type(
    "foxglove",
    "FrameTransform",
    (
        ProtobufField("timestamp", 1, Kind.MESSAGE, _STAMP),
        ProtobufField("parent_frame_id", 2, Kind.STRING),
        ProtobufField("child_frame_id", 3, Kind.STRING),
        ProtobufField("translation", 4, Kind.MESSAGE, ".foxglove.Vector3"),
        ProtobufField("rotation", 5, Kind.MESSAGE, ".foxglove.Quaternion"),
    ),
)
_TRANSFORMS = Type(
    "foxglove",
    "FrameTransforms",
    (ProtobufField("transforms", 1, Kind.MESSAGE, ".foxglove.FrameTransform", repeated=True),),
)
_POSE = Type(
    "foxglove",
    "Pose",
    (
        ProtobufField("position", 1, Kind.MESSAGE, ".foxglove.Vector3"),
        ProtobufField("orientation", 2, Kind.MESSAGE, ".foxglove.Quaternion"),
    ),
)
_POSES = Type(
    "foxglove",
    "PosesInFrame",
    (
        ProtobufField("timestamp", 1, Kind.MESSAGE, _STAMP),
        ProtobufField("frame_id", 2, Kind.STRING),
        ProtobufField("poses", 3, Kind.MESSAGE, ".foxglove.Pose", repeated=True),
    ),
)
_VECTORS = (_doubles("Vector3", "xyz"), _doubles("Quaternion", "xyzw"))
_TYPES: dict[str, tuple[Type, ...]] = {
    "foxglove.CameraCalibration": (_TIMESTAMP, *CALIBRATION),
    "foxglove.ImageAnnotations": (_TIMESTAMP, *ANNOTATIONS),
    "foxglove.CompressedImage": (_TIMESTAMP, _IMAGE),
    "foxglove.CompressedVideo": (_TIMESTAMP, _VIDEO),
    "foxglove.Log": (_TIMESTAMP, _LOG),
    "foxglove.FrameTransforms": (_TIMESTAMP, *_VECTORS, _TRANSFORM, _TRANSFORMS),
    "foxglove.PosesInFrame": (_TIMESTAMP, *_VECTORS, _POSE, _POSES),
}


@dataclass(frozen=True, slots=True)
class Transform:
    """Pose of a frame in its parent: position [m] and unit quaternion (w, x, y, z)."""

    parent: str
    child: str
    position_m: tuple[float, float, float]
    rotation_wxyz: tuple[float, float, float, float]


def is_for_viewers(channel: str) -> bool:
    """Return whether a channel repeats another one for viewers."""
    return channel in _CHANNELS or channel.startswith((*PICTURE_PREFIXES, TRAJECTORY_PREFIX))


@cache
def viewer_descriptor(name: str) -> bytes:
    """Return the FileDescriptorSet of a well-known type."""
    return descriptor_set(_TYPES[name])


def stamp(time_ns: int) -> bytes:
    """Return a protobuf Timestamp of a UNIX time [ns]."""
    seconds, nanoseconds = divmod(time_ns, NS_PER_S)
    return integer(1, seconds) + integer(2, nanoseconds)


def image(time_ns: int, frame: str, kind: str, header: bytes, data: bytes) -> bytes:
    """Return a CompressedImage (format `jpeg`, ...) with our header as JSON."""
    front = blob(1, stamp(time_ns)) + blob(3, kind.encode()) + blob(4, frame.encode())
    return front + blob(_HEADER_FIELD, header) + blob(2, data)


def video(time_ns: int, frame: str, kind: str, header: bytes, data: bytes) -> bytes:
    """Return a CompressedVideo (format `h264`, ...) with our header as JSON."""
    front = blob(1, stamp(time_ns)) + blob(2, frame.encode()) + blob(4, kind.encode())
    return front + blob(_HEADER_FIELD, header) + blob(3, data)


def picture_parts(data: bytes, is_video: bool) -> tuple[bytes, bytes]:
    """Return (header as JSON, picture) of `image` or `video`; raises ValueError when it is neither."""
    found = dict(fields(data))
    header, picture = found.get(_HEADER_FIELD), found.get(3 if is_video else 2)
    if not isinstance(header, bytes) or not isinstance(picture, bytes):
        raise ValueError("no picture of ours")
    return header, picture


def log_line(time_ns: int, level: str, name: str, text: str) -> bytes:
    """Return a Log line; levels are those of `Severity`."""
    front = blob(1, stamp(time_ns)) + integer(2, _LEVELS.index(level))
    return front + blob(3, text.encode()) + blob(4, name.encode())


def frame_transforms(time_ns: int, transforms: tuple[Transform, ...]) -> bytes:
    """Return FrameTransforms of one moment."""
    when = blob(1, stamp(time_ns))
    return b"".join(blob(1, when + _transform(one)) for one in transforms)


def poses_in_frame(time_ns: int, frame: str, poses: Iterable[Transform]) -> bytes:
    """Return PosesInFrame: poses of one body in one frame, oldest first; time_ns: of the newest."""
    front = blob(1, stamp(time_ns)) + blob(2, frame.encode())
    return front + b"".join(blob(3, blob(1, place) + blob(2, turn)) for place, turn in map(_pose, poses))


def _transform(one: Transform) -> bytes:
    place, turn = _pose(one)
    return blob(2, one.parent.encode()) + blob(3, one.child.encode()) + blob(4, place) + blob(5, turn)


def _pose(one: Transform) -> tuple[bytes, bytes]:
    """Return a Vector3 and a Quaternion."""
    w, *vector = one.rotation_wxyz
    place, turn = (
        b"".join(double(number, value) for number, value in enumerate(values, 1))
        for values in (one.position_m, (*vector, w))
    )
    return place, turn

"""Messages of which only stamp and numbers change: their bytes are made once, then filled in.

Each type here, or each element of its sequence, begins with a header and ends with all its numbers. Stencils are cut
from bytes that the type store encodes, so that the layout is the store's.
"""

import struct
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from groundstation.engineering_views.ros2.codec import Ros2Codec, RosMessage
from groundstation.engineering_views.ros2.geometry import Builder
from groundstation.time_units import NS_PER_S

_ENCAPSULATION, _SEQUENCE, _STAMP = 4, 4, struct.Struct("<iI")
_ORIGIN = (0.0, 0.0, 0.0)


class Form(NamedTuple):
    """A type, one of its messages for entities with all numbers 0, and the place of its first stamp."""

    type: str
    blank: Callable[[Builder, tuple[str, ...]], dict[str, Any]]
    stamp_at: int = _ENCAPSULATION


class Stencils:
    """Fills the messages of each topic and its entities; the first of each cuts its stencil."""

    def __init__(self, codec: Ros2Codec) -> None:
        self._codec, self._build = codec, Builder(codec)
        self._cut: dict[tuple[str, tuple[str, ...]], tuple[bytes, list[bytes]]] = {}

    def filled(self, topic: str, form: Form, stamp_ns: int, numbers: Mapping[str, tuple[float, ...]]) -> RosMessage:
        """Return the message of a topic; numbers: by entity, all numbers of the type, in its order."""
        names = tuple(numbers)
        begin, texts = self._cut.get((topic, names)) or self._cut_out(topic, form, numbers)
        stamp, parts = _STAMP.pack(*divmod(stamp_ns, NS_PER_S)), [begin]
        for text, values in zip(texts, numbers.values(), strict=True):
            parts += (stamp, text, struct.pack(f"<{len(values)}d", *values))
        return RosMessage(topic, form.type, b"".join(parts))

    def _cut_out(self, topic: str, form: Form, numbers: Mapping[str, tuple[float, ...]]) -> tuple[bytes, list[bytes]]:
        names = tuple(numbers)
        blanks = [
            self._codec.message(topic, form.type, **form.blank(self._build, names[:n])).data
            for n in range(1, len(names) + 1)
        ]
        ends = [form.stamp_at, *map(len, blanks)]
        texts = [
            blanks[-1][begin + _STAMP.size : end - 8 * len(values)]
            for (begin, end), values in zip(pairwise(ends), numbers.values(), strict=True)
        ]
        return self._cut.setdefault((topic, names), (blanks[-1][: form.stamp_at], texts))


def _frames(build: Builder, names: tuple[str, ...]) -> dict[str, Any]:
    turn = build.quaternion((0.0, 0.0, 0.0, 0.0))
    return {"transforms": [build.transform(0, ("world", name), _ORIGIN, turn) for name in names]}


def _pose(build: Builder, _: tuple[str, ...]) -> dict[str, Any]:
    return {"header": build.header(0), "pose": build.pose(_ORIGIN, 0.0)}


def _sure_pose(build: Builder, _: tuple[str, ...]) -> dict[str, Any]:
    pose = build.make("geometry_msgs/msg/PoseWithCovariance", pose=build.pose(_ORIGIN, 0.0), covariance=np.zeros(36))
    return {"header": build.header(0), "pose": pose}


def _odometry(build: Builder, names: tuple[str, ...]) -> dict[str, Any]:
    twist = build.make("geometry_msgs/msg/TwistWithCovariance", twist=build.twist(_ORIGIN), covariance=np.zeros(36))
    return _sure_pose(build, names) | {"child_frame_id": names[0], "twist": twist}


def _twist(build: Builder, names: tuple[str, ...]) -> dict[str, Any]:
    return {"header": build.header(0, names[0]), "twist": build.twist(_ORIGIN)}


# of each entity position (x, y, z) and rotation (x, y, z, w)
FRAMES = Form("tf2_msgs/msg/TFMessage", _frames, _ENCAPSULATION + _SEQUENCE)
POSE = Form("geometry_msgs/msg/PoseStamped", _pose)
# the same, and the covariance (6, 6)
SURE_POSE = Form("geometry_msgs/msg/PoseWithCovarianceStamped", _sure_pose)
# the same, and velocity and turn about (x, y, z), and their covariance (6, 6)
ODOMETRY = Form("nav_msgs/msg/Odometry", _odometry)
# velocity and turn about (x, y, z)
TWIST = Form("geometry_msgs/msg/TwistStamped", _twist)

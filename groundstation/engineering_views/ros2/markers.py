"""Ellipses, links and commanded velocities of the scene as RViz markers, five times a second."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from groundstation.appearance.colours import Rgb
from groundstation.bus import messages as m
from groundstation.engineering_views.ros2.codec import Ros2Codec, RosMessage
from groundstation.engineering_views.ros2.geometry import Builder
from groundstation.engineering_views.ros2.names import own
from groundstation.engineering_views.scene import LINK_COLOUR, Body, SensingLink, ViewScene
from groundstation.time_units import NS_PER_S

_PERIOD_NS = NS_PER_S // 5
# WIRE (docs/reference/ros2.md 3): visualization_msgs/msg/Marker.
_ARROW, _DISC, _LINE_STRIP, _TEXT = 0, 3, 4, 9
_LIFETIME_S = 1
_DISC_M, _TEXT_M, _SHAFT_M, _HEAD_M = 0.01, 0.18, 0.03, 0.07
_FAINT = 0.35
MARKERS = "visualization_msgs/msg/MarkerArray"


class MarkerScene:
    """Collects drawings; each marker vanishes after a second, so that no old one remains."""

    def __init__(self, codec: Ros2Codec, view: ViewScene) -> None:
        self._codec, self._build, self._view = codec, Builder(codec), view
        self._blank = _blank(self._build)
        self._numbers: dict[str, int] = {}
        self._plan: m.Plan | None = None
        self._setpoints: dict[str, m.VelocitySetpoint] = {}
        self._next_ns = 0

    def take(self, message: m.Plan | m.VelocitySetpoint) -> None:
        """Keep a message for the next picture."""
        if isinstance(message, m.Plan):
            self._plan = message
        else:
            self._setpoints[message.header.entity] = message

    def drawn(self, stamp_ns: int, bodies: Iterable[Body]) -> list[RosMessage]:
        """Return a picture of the bodies and of messages since the last one, or nothing until one is due."""
        if self._next_ns - _PERIOD_NS <= stamp_ns < self._next_ns:
            return []
        self._next_ns = stamp_ns + _PERIOD_NS
        markers = [*self._bodies(stamp_ns, bodies), *self._links(stamp_ns), *self._arrows(stamp_ns)]
        self._plan, self._setpoints = None, {}
        return [self._codec.message(own("markers"), MARKERS, markers=markers)]

    def _bodies(self, stamp_ns: int, bodies: Iterable[Body]) -> Iterator[Any]:
        for body in bodies:
            colour, (x, y, z), (major, minor, turn) = self._view.colour(body.name), body.position_m, body.semi_axes_95
            size, place = self._build.vector((2 * major, 2 * minor, _DISC_M)), self._build.pose((x, y, z), turn)
            yield self._marker(stamp_ns, f"ellipse {body.name}", colour, _FAINT, type=_DISC, scale=size, pose=place)
            size, place = self._build.vector((0.0, 0.0, _TEXT_M)), self._build.pose((x, y, z + _TEXT_M), 0.0)
            said = {"type": _TEXT, "scale": size, "pose": place, "text": body.name}
            yield self._marker(stamp_ns, f"name {body.name}", colour, **said)

    def _links(self, stamp_ns: int) -> Iterator[Any]:
        links: list[SensingLink] = [] if self._plan is None else self._view.links(self._plan)
        for link in links:
            size = self._build.vector((2 * link.half_width_m, 0.0, 0.0))
            points = [self._build.point(end_m) for end_m in (link.begin_m, link.end_m)]
            yield self._marker(stamp_ns, link.name, LINK_COLOUR, type=_LINE_STRIP, scale=size, points=points)

    def _arrows(self, stamp_ns: int) -> Iterator[Any]:
        size = self._build.vector((_SHAFT_M, _HEAD_M, 0.0))
        for name, setpoint in self._setpoints.items():
            found = self._view.arrow(setpoint)
            if found is not None:
                begin_m, vector_m = found
                points = [self._build.point(tuple(end_m)) for end_m in (begin_m, begin_m + vector_m)]
                colour = self._view.colour(name)
                yield self._marker(stamp_ns, f"setpoint {name}", colour, type=_ARROW, scale=size, points=points)

    def _marker(self, stamp_ns: int, name: str, colour: Rgb, opacity: float = 1.0, **shown: Any) -> Any:
        red, green, blue = (part / 255.0 for part in colour)
        said = {
            "header": self._build.header(stamp_ns),
            "ns": name.partition(" ")[0],
            "id": self._numbers.setdefault(name, len(self._numbers)),
            "color": self._build.make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=opacity),
        }
        return self._build.make("visualization_msgs/msg/Marker", **(self._blank | said | shown))


def _blank(build: Builder) -> dict[str, Any]:
    """Return the fields that all markers share, most of them empty."""
    make, nothing = build.make, np.zeros(0, np.uint8)
    return {
        "action": 0,
        "pose": build.pose((0.0, 0.0, 0.0), 0.0),
        "lifetime": make("builtin_interfaces/msg/Duration", sec=_LIFETIME_S, nanosec=0),
        "frame_locked": False,
        "points": [],
        "colors": [],
        "texture_resource": "",
        "texture": make("sensor_msgs/msg/CompressedImage", header=build.header(0, ""), format="", data=nothing),
        "uv_coordinates": [],
        "text": "",
        "mesh_resource": "",
        "mesh_file": make("visualization_msgs/msg/MeshFile", filename="", data=nothing),
        "mesh_use_embedded_materials": False,
    }

"""Ellipses, links and arrows of the scene as RViz markers."""

from typing import Any

import numpy as np

from groundstation.appearance.colours import Rgb
from groundstation.arrays import Array
from groundstation.engineering_views.ros2.codec import Ros2Codec
from groundstation.engineering_views.ros2.geometry import Builder
from groundstation.engineering_views.scene import LINK_COLOUR, Body, SensingLink

# WIRE (docs/reference/ros2.md 3): visualization_msgs/msg/Marker.
_ARROW, _LINE_STRIP, _TEXT = 0, 4, 9
_LIFETIME_S = 1
_LINE_M, _TEXT_M, _SHAFT_M, _HEAD_M = 0.02, 0.18, 0.03, 0.07


class MarkerMaker:
    """Makes markers that vanish after a second, so that nothing old is left standing."""

    def __init__(self, codec: Ros2Codec) -> None:
        self._build, self._make = Builder(codec), codec.make
        self._numbers: dict[str, int] = {}

    def body(self, stamp_ns: int, body: Body, colour: Rgb) -> list[Any]:
        """Return the 95 % ellipse and the name of a body."""
        ring = self._marker(stamp_ns, f"ellipse {body.name}", _LINE_STRIP, (_LINE_M, 0.0, 0.0), colour)
        ring.points = self._points(body.ring_m)
        x, y, z = body.position_m
        name = self._marker(stamp_ns, f"name {body.name}", _TEXT, (0.0, 0.0, _TEXT_M), colour)
        name.pose, name.text = self._build.pose((x, y, z + _TEXT_M), 0.0), body.name
        return [ring, name]

    def link(self, stamp_ns: int, link: SensingLink) -> Any:
        """Return a link of the sensing topology; its width grows with its information."""
        line = self._marker(stamp_ns, link.name, _LINE_STRIP, (2 * link.half_width_m, 0.0, 0.0), LINK_COLOUR)
        line.points = self._points(np.array([link.begin_m, link.end_m]))
        return line

    def arrow(self, stamp_ns: int, name: str, begin_m: Array, vector_m: Array, colour: Rgb) -> Any:
        """Return a commanded velocity."""
        arrow = self._marker(stamp_ns, f"setpoint {name}", _ARROW, (_SHAFT_M, _HEAD_M, 0.0), colour)
        arrow.points = self._points(np.array([begin_m, begin_m + vector_m]))
        return arrow

    def _points(self, xyz: Array) -> list[Any]:
        return [self._build.point((row[0], row[1], row[2])) for row in xyz]

    def _marker(self, stamp_ns: int, name: str, kind: int, scale: tuple[float, float, float], colour: Rgb) -> Any:
        make, build = self._make, self._build
        red, green, blue = (part / 255.0 for part in colour)
        empty = make(
            "sensor_msgs/msg/CompressedImage", header=build.header(0, ""), format="", data=np.zeros(0, np.uint8)
        )
        return make(
            "visualization_msgs/msg/Marker",
            header=build.header(stamp_ns),
            ns=name.partition(" ")[0],
            id=self._numbers.setdefault(name, len(self._numbers)),
            type=kind,
            action=0,
            pose=build.pose((0.0, 0.0, 0.0), 0.0),
            scale=build.vector(scale),
            color=make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=1.0),
            lifetime=make("builtin_interfaces/msg/Duration", sec=_LIFETIME_S, nanosec=0),
            frame_locked=False,
            points=[],
            colors=[],
            texture_resource="",
            texture=empty,
            uv_coordinates=[],
            text="",
            mesh_resource="",
            mesh_file=make("visualization_msgs/msg/MeshFile", filename="", data=np.zeros(0, np.uint8)),
            mesh_use_embedded_materials=False,
        )

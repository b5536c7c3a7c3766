"""Turns our messages into Rerun's: a room with drones, ellipses, links and arrows, pictures, plots and a log.

Needs the extra [rerun]. Nothing here talks to a network: the stream's sink is the caller's choice.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.appearance.colours import Rgb
from groundstation.appearance.cost import COST_UNIT, cost_cm2
from groundstation.appearance.topology import topology_words
from groundstation.bus import messages as m
from groundstation.bus.topics import Topic
from groundstation.engineering_views.scene import (
    FENCE,
    LINK_COLOUR,
    OBSTACLE_COLOUR,
    VOLUME_COLOUR,
    Body,
    Sides,
    ViewScene,
)
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import Room
from groundstation.geometry.angles import quaternion_from_euler
from groundstation.recording.viewers import Transform
from groundstation.time_units import NS_PER_S

# Viewers need no higher rate, and each log call takes tens of microseconds.
_PERIOD_NS = NS_PER_S // 10
_ARM_M = 0.25
_PICTURE_DISTANCE_M = 0.4
_LEVELS = {"INFO": "INFO", "WARNING": "WARN", "ERROR": "ERROR"}


class RerunScene:
    """Feeds one recording stream, message by message, in order of time; mark: text over the room."""

    def __init__(self, stream: rr.RecordingStream, field: ResolvedField | None, start_ns: int, mark: str = "") -> None:
        self._stream = stream
        self._scene = ViewScene(field)
        self._start_ns = start_ns
        self._next_ns: dict[str, int] = {}
        self._camera_paths: dict[str, str] = {}
        self._topology = ""
        self._searched: set[str] = set()
        self._takers: dict[type[m.Message], Callable[[Any], None]] = {
            m.Estimate: self._estimate,
            m.SearchMap: self._search_map,
            m.Plan: self._plan,
            m.VelocitySetpoint: self._setpoint,
            m.Innovation: self._innovation,
            m.VehicleStatus: self._vehicle,
            m.ProcessStatus: self._process,
            m.TruthState: self._truth,
            m.Event: self._event,
        }
        self._log_static()
        if mark:
            self._log("world/mark", rr.Points3D([self._scene.top_m], labels=[mark], show_labels=True), static=True)

    def take(self, time_ns: int, message: m.Message) -> None:
        """Show a message; kinds that are not drawn are ignored."""
        taker = self._takers.get(type(message))
        if taker is None or not self._due(time_ns, message):
            return
        self._set_time(time_ns)
        taker(message)

    def take_picture(self, time_ns: int, camera: str, topic: Topic, data: bytes) -> None:
        """Show a picture (JPEG), or a piece of an H.264 stream, of a camera."""
        self._set_time(time_ns)
        path = f"{self._camera_paths.get(camera, f'cameras/{camera}')}/picture"
        if topic.encoding.startswith("video/"):
            self._stream.log(path, rr.VideoStream(codec=rr.VideoCodec.H264, sample=data))
        else:
            self._stream.log(path, rr.EncodedImage(contents=data, media_type=topic.encoding))

    def _due(self, time_ns: int, message: m.Message) -> bool:
        if isinstance(message, m.Event | m.Innovation):
            return True
        name = f"{type(message).__name__} {message.header.entity}"
        due_ns = self._next_ns.get(name, 0)
        if due_ns - _PERIOD_NS <= time_ns < due_ns:
            return False
        self._next_ns[name] = time_ns + _PERIOD_NS
        return True

    def _set_time(self, time_ns: int) -> None:
        self._stream.set_time("time", timestamp=np.datetime64(time_ns, "ns"))
        self._stream.set_time("since start", duration=np.timedelta64(time_ns - self._start_ns, "ns"))

    def _log(self, path: str | list[object], *parts: Any, static: bool = False) -> None:
        self._stream.log(path, *parts, static=static)

    def _log_static(self) -> None:
        field = self._scene.field
        self._log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        if field is None:
            return
        self._log_room(field.room)
        for name, sides in self._scene.volumes.items():
            self._log_box(f"world/{name}", sides, VOLUME_COLOUR, name)
        for name, sides in self._scene.obstacles.items():
            self._log_box(f"world/obstacles/{name}", sides, OBSTACLE_COLOUR, name)
        for camera in self._scene.cameras:
            self._log_camera(camera, field)

    def _log_room(self, room: Room) -> None:
        x, y, z = room.size_m
        self._log_box("world/room", ((-x / 2, x / 2), (-y / 2, y / 2), (0.0, z)), (90, 90, 90))
        self._log_box("world/fence", (room.fence.x_m, room.fence.y_m, room.fence.z_m), FENCE)

    def _log_box(self, path: str, sides: Sides, colour: Rgb, label: str = "") -> None:
        low, high = np.array(sides).T
        labels = [label] if label else None
        wire = rr.components.FillMode.MajorWireframe
        box = rr.Boxes3D(mins=[low], sizes=[high - low], colors=[colour], fill_mode=wire, labels=labels)
        self._log(path, box, static=True)

    def _log_camera(self, camera: Transform, field: ResolvedField) -> None:
        name = camera.child
        source = field.cameras[name] if camera.parent == "world" else field.drones[camera.parent].camera
        lens = source.calibration
        path = f"world/{name}" if camera.parent == "world" else f"world/{camera.parent}/camera"
        self._camera_paths[name] = path
        w, x, y, z = camera.rotation_wxyz
        pose = rr.Transform3D(translation=camera.position_m, quaternion=rr.Quaternion(xyzw=[x, y, z, w]))
        pinhole = rr.Pinhole(
            focal_length=[lens.fx_px, lens.fy_px],
            principal_point=[lens.cx_px, lens.cy_px],
            resolution=[lens.width_px, lens.height_px],
            image_plane_distance=_PICTURE_DISTANCE_M,
        )
        self._log(path, pose, pinhole, static=True)

    def _estimate(self, message: m.Estimate) -> None:
        for name in self._searched - {search.target for search in message.searches}:
            self._log(f"world/searched/{name}", rr.Clear(recursive=False))
            self._searched.remove(name)
        for body in self._scene.take_estimate(message):
            self._log_body(body)
            self._log(f"plots/std/{body.name}", rr.Scalars(body.std_m))

    def _log_body(self, body: Body) -> None:
        path, colour = f"world/{body.name}", self._scene.colour(body.name)
        w, x, y, z = quaternion_from_euler(0.0, 0.0, body.yaw_rad)
        self._log(path, rr.Transform3D(translation=body.position_m, quaternion=rr.Quaternion(xyzw=[x, y, z, w])))
        size = [_ARM_M, _ARM_M, 0.06]
        self._log(f"{path}/body", rr.Boxes3D(half_sizes=[size], colors=[colour], labels=[body.name]))
        if not body.is_target:
            self._log(f"{path}/heading", rr.Arrows3D(vectors=[[2 * _ARM_M, 0, 0]], colors=[colour]))
        self._log(f"world/ellipse_95/{body.name}", rr.LineStrips3D([body.ring_m], radii=[0.008], colors=[colour]))

    def _search_map(self, message: m.SearchMap) -> None:
        cells, colour = self._scene.cells(message), self._scene.colour(message.header.entity)
        shown = rr.Boxes3D(
            centers=[cell.centre_m for cell in cells],
            half_sizes=[[cell.side_m / 2, cell.side_m / 2, 0.01] for cell in cells],
            colors=[[*colour, round(180 * cell.share)] for cell in cells],
            fill_mode=rr.components.FillMode.Solid,
        )
        self._log(f"world/searched/{message.header.entity}", shown)
        self._searched.add(message.header.entity)

    def _plan(self, message: m.Plan) -> None:
        links = self._scene.links(message)
        strips = rr.LineStrips3D(
            [[link.begin_m, link.end_m] for link in links],
            radii=[link.half_width_m for link in links],
            colors=[LINK_COLOUR],
            labels=[link.name for link in links],
            show_labels=False,
        )
        self._log("world/links", strips)
        self._log("plots/cost/chosen", rr.Scalars(cost_cm2(message.cost)))
        for other in message.alternatives:
            self._log(["plots", "cost", topology_words(other.topology)], rr.Scalars(cost_cm2(other.cost)))
        if message.topology != self._topology:
            self._topology = message.topology
            self._log("log/topology", rr.TextLog(f"{topology_words(message.topology)} ({message.mode})", level="INFO"))

    def _setpoint(self, message: m.VelocitySetpoint) -> None:
        arrow = self._scene.arrow(message)
        if arrow is not None:
            name = message.header.entity
            shown = rr.Arrows3D(origins=[arrow[0]], vectors=[arrow[1]], colors=[self._scene.colour(name)])
            self._log(f"world/commanded/{name}", shown)

    def _innovation(self, message: m.Innovation) -> None:
        if message.nis is not None and math.isfinite(message.nis):
            self._log(["plots", "nis", f"{message.observer} sees {message.subject}"], rr.Scalars(message.nis))

    def _vehicle(self, message: m.VehicleStatus) -> None:
        name = message.header.entity
        if message.battery is not None:
            self._log(f"plots/battery/{name}", rr.Scalars(message.battery))
        self._log(f"plots/telemetry_hz/{name}", rr.Scalars(message.rate_hz))

    def _process(self, message: m.ProcessStatus) -> None:
        self._log(f"plots/cpu/{message.header.entity}", rr.Scalars(message.cpu))

    def _truth(self, message: m.TruthState) -> None:
        name = message.header.entity
        dot = rr.Points3D([message.position_m], radii=[0.05], colors=[[150] * 3])
        self._log(f"world/truth/{name}", dot)

    def _event(self, message: m.Event) -> None:
        text = f"{message.text} ({message.remedy})" if message.remedy else message.text
        self._log(f"log/{message.header.entity}", rr.TextLog(text, level=_LEVELS[message.severity]))


def blueprint(field: ResolvedField | None) -> rrb.Blueprint:
    """Return the layout: room and pictures on the left, plots and log on the right."""
    cameras = ViewScene(field).cameras
    paths = [f"world/{one.child}" if one.parent == "world" else f"world/{one.parent}/camera" for one in cameras]
    pictures = [rrb.Spatial2DView(origin=path, name=one.child) for path, one in zip(paths, cameras, strict=True)]
    plots = [
        rrb.TimeSeriesView(origin=f"plots/{name}", name=title)
        for name, title in (
            ("std", "standard deviation [m]"),
            ("cost", f"cost of topologies [{COST_UNIT}]"),
            ("nis", "normalised innovation squared"),
            ("battery", "battery"),
            ("cpu", "cores used"),
        )
    ]
    left = rrb.Vertical(rrb.Spatial3DView(origin="world", name="room"), rrb.Horizontal(*pictures), row_shares=[3, 1])
    right = rrb.Vertical(rrb.Tabs(*plots), rrb.TextLogView(origin="/", name="log"))
    return rrb.Blueprint(rrb.Horizontal(left, right, column_shares=[3, 2]))

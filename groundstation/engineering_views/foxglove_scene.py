"""Room, drones, ellipses, links and arrows as a Foxglove SceneUpdate. Needs the extra [foxglove]."""

import math
from collections.abc import Callable, Collection, Iterable
from typing import Any

import numpy as np
from foxglove import Schema
from foxglove import messages as fm

from groundstation.appearance.colours import NEUTRAL_COLOUR, Rgb, rgb
from groundstation.arrays import Array
from groundstation.bus import messages as m
from groundstation.engineering_views.scene import (
    FENCE,
    LINK_COLOUR,
    OBSTACLE_COLOUR,
    VOLUME_COLOUR,
    Body,
    SearchCell,
    SensingLink,
    ViewScene,
)
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.angles import quaternion_from_euler
from groundstation.time_units import NS_PER_S

_PERIOD_NS = NS_PER_S // 10
_FRAME = "world"
_HALF_BODY_M = 0.25
_NAME_M, _MARK_M = 0.15, 0.4
_ROOM_COLOUR: Rgb = (120, 120, 120)


def scene_schema() -> Schema:
    """Return the schema of the encoded updates."""
    return fm.SceneUpdate.get_schema()


class FoxgloveScene:
    """Follows the messages and makes a new scene at most ten times a second; mark: text over the room."""

    def __init__(self, field: ResolvedField | None, mark: str = "") -> None:
        self._scene = ViewScene(field)
        self._mark = [_text(mark, self._scene.top_m, _MARK_M, rgb(NEUTRAL_COLOUR.dark))] if mark else []
        boxes = [_box(sides, VOLUME_COLOUR) for sides in self._scene.volumes.values()]
        boxes += [_box(sides, OBSTACLE_COLOUR) for sides in self._scene.obstacles.values()]
        self._static = [*_static(field), *(line for box in boxes for line in box)]
        self._links: list[SensingLink] = []
        self._arrows: dict[str, tuple[Array, Array]] = {}
        self._searched: dict[str, list[SearchCell]] = {}
        self._next_ns = 0

    def take(self, time_ns: int, message: m.Message) -> bytes | None:
        """Return an encoded SceneUpdate if the message is an estimate and a scene is due, else None."""
        match message:
            case m.SearchMap():
                self._searched[message.header.entity] = self._scene.cells(message)
            case m.Plan():
                self._links = self._scene.links(message)
            case m.VelocitySetpoint():
                arrow = self._scene.arrow(message)
                if arrow is not None:
                    self._arrows[message.header.entity] = arrow
            case m.Estimate():
                bodies = self._scene.take_estimate(message)
                if not self._next_ns - _PERIOD_NS <= time_ns < self._next_ns:
                    self._next_ns = time_ns + _PERIOD_NS
                    return self._update(time_ns, bodies, {search.target for search in message.searches})
        return None

    def _update(self, time_ns: int, bodies: list[Body], searched: Collection[str]) -> bytes:
        stamp = fm.Timestamp(*divmod(time_ns, NS_PER_S))

        def entity(name: str, **parts: Any) -> fm.SceneEntity:
            return fm.SceneEntity(timestamp=stamp, frame_id=_FRAME, id=name, **parts)

        links = [_line([link.begin_m, link.end_m], LINK_COLOUR, 2 * link.half_width_m) for link in self._links]
        arrows = [_arrow(*arrow, self._scene.colour(name)) for name, arrow in self._arrows.items()]
        drawn = [self._body(entity, body) for body in bodies]
        cells = [_cell(cell, self._scene.colour(name)) for name in searched for cell in self._searched.get(name, ())]
        parts = [entity("room", lines=self._static, texts=self._mark), *drawn, entity("links", lines=links)]
        parts.append(entity("searched", cubes=cells))
        update: bytes = fm.SceneUpdate(entities=[*parts, entity("commanded", arrows=arrows)]).encode()
        return update

    def _body(self, entity: Callable[..., fm.SceneEntity], body: Body) -> fm.SceneEntity:
        colour = self._scene.colour(body.name)
        x, y, z = body.position_m
        label = _text(body.name, (x, y, z + 0.3), _NAME_M, colour)
        cube = fm.CubePrimitive(
            pose=_pose(body.position_m, 0.0, body.yaw_rad),
            size=fm.Vector3(x=2 * _HALF_BODY_M, y=2 * _HALF_BODY_M, z=0.1),
            color=_colour(colour),
        )
        ring = _line(body.ring_m.tolist(), colour, 0.015)
        return entity(body.name, cubes=[cube], texts=[label], lines=[ring])


def _static(field: ResolvedField | None) -> list[fm.LinePrimitive]:
    if field is None:
        return []
    (x, y, z), own = field.room.size_m, field.room.fence
    fence = [own.x_m, own.y_m, own.z_m]
    whole = [(-x / 2, x / 2), (-y / 2, y / 2), (0.0, z)]
    return [*_box(whole, _ROOM_COLOUR), *_box(fence, FENCE)]


def _box(sides: Iterable[tuple[float, float]], colour: Rgb) -> list[fm.LinePrimitive]:
    (x0, x1), (y0, y1), (z0, z1) = sides
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    rings = [_line([(x, y, z) for x, y in corners], colour, 0.01) for z in (z0, z1)]
    return [*rings, *(_line([(x, y, z0), (x, y, z1)], colour, 0.01) for x, y in corners[:4])]


def _cell(cell: SearchCell, own: Rgb) -> fm.CubePrimitive:
    size = fm.Vector3(x=cell.side_m, y=cell.side_m, z=0.02)
    red, green, blue = (part / 255 for part in own)
    colour = fm.Color(r=red, g=green, b=blue, a=0.7 * cell.share)
    return fm.CubePrimitive(pose=_pose(cell.centre_m, 0.0, 0.0), size=size, color=colour)


def _text(text: str, position_m: tuple[float, float, float], height_m: float, colour: Rgb) -> fm.TextPrimitive:
    pose = _pose(position_m, 0.0, 0.0)
    return fm.TextPrimitive(pose=pose, billboard=True, font_size=height_m, color=_colour(colour), text=text)


def _line(points: Iterable[Iterable[float]], colour: Rgb, thickness_m: float) -> fm.LinePrimitive:
    placed = [fm.Point3(x=x, y=y, z=z) for x, y, z in points]
    kind = fm.LinePrimitiveLineType.LineStrip
    return fm.LinePrimitive(type=kind, thickness=thickness_m, points=placed, color=_colour(colour))


def _arrow(origin_m: Array, vector_m: Array, colour: Rgb) -> fm.ArrowPrimitive:
    length = float(np.linalg.norm(vector_m))
    yaw = math.atan2(vector_m[1], vector_m[0])
    pitch = -math.atan2(vector_m[2], math.hypot(vector_m[0], vector_m[1]))  # nose down is positive
    x, y, z = origin_m.tolist()
    return fm.ArrowPrimitive(
        pose=_pose((x, y, z), pitch, yaw),
        shaft_length=0.8 * length,
        shaft_diameter=0.04,
        head_length=0.2 * length,
        head_diameter=0.09,
        color=_colour(colour),
    )


def _pose(position_m: tuple[float, float, float], pitch_rad: float, yaw_rad: float) -> fm.Pose:
    w, qx, qy, qz = quaternion_from_euler(0.0, pitch_rad, yaw_rad)
    x, y, z = position_m
    return fm.Pose(position=fm.Vector3(x=x, y=y, z=z), orientation=fm.Quaternion(x=qx, y=qy, z=qz, w=w))


def _colour(rgb: Rgb) -> fm.Color:
    r, g, b = (part / 255.0 for part in rgb)
    return fm.Color(r=r, g=g, b=b, a=1.0)

"""The scene, independent of any viewer: bodies, 95 % ellipses, links, arrows, in the world frame."""

import math
from dataclasses import dataclass

import numpy as np

from groundstation.appearance.colours import FENCE_COLOUR, NEUTRAL_COLOUR, Rgb, colours_of, rgb
from groundstation.arrays import Array
from groundstation.bus import messages as m
from groundstation.bus.topics import ESTIMATE, PLAN, SEARCH_MAP, SETPOINT
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.ellipse import semi_axes_95
from groundstation.recording.derived import camera_frames
from groundstation.recording.viewers import Transform
from groundstation.sensing.from_field import boxes_from_field

Sides = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]

_RING_POINTS = 40
_CIRCLE = np.linspace(0.0, 2.0 * math.pi, _RING_POINTS + 1)
_COS, _SIN = np.cos(_CIRCLE), np.sin(_CIRCLE)
LINK_COLOUR: Rgb = (130, 130, 130)
VOLUME_COLOUR: Rgb = (140, 150, 110)
OBSTACLE_COLOUR: Rgb = (150, 120, 90)
FENCE: Rgb = rgb(FENCE_COLOUR.dark)
_LIKELY_AT_ALL = 0.03
_USUAL_HEIGHT_M = 4.0
# Messages from which bodies, links, arrows and cells are made.
DRAWN = (ESTIMATE, PLAN, SEARCH_MAP, SETPOINT)
# An arrow is as long as the way flown in this time.
ARROW_S = 2.0


@dataclass(frozen=True, slots=True)
class Body:
    """A robot or a target: position [m; world], yaw [rad] (0 without one), covariance of x and y (2, 2)."""

    name: str
    is_target: bool
    position_m: tuple[float, float, float]
    yaw_rad: float
    covariance_m2: Array

    @property
    def std_m(self) -> float:
        """Return the standard deviation of the place on the floor."""
        return math.sqrt(max(0.0, float(np.trace(self.covariance_m2))))

    @property
    def semi_axes_95(self) -> tuple[float, float, float]:
        """Return major and minor semi-axis [m] of the 95 % ellipse of x and y, and heading of the major one [rad]."""
        (xx, xy), (_, yy) = self.covariance_m2.tolist()
        return semi_axes_95(xx, xy, yy)

    @property
    def ring_m(self) -> Array:
        """Return that ellipse around the position, at its height (n, 3) [m; world]."""
        (x, y, z), (major, minor, turn) = self.position_m, self.semi_axes_95
        along, across, c, s = major * _COS, minor * _SIN, math.cos(turn), math.sin(turn)
        return np.column_stack((x + c * along - s * across, y + s * along + c * across, np.full(len(_COS), z)))


@dataclass(frozen=True, slots=True)
class SensingLink:
    """An edge of the topology as a line whose half-width [m] grows with its information."""

    name: str
    begin_m: tuple[float, float, float]
    end_m: tuple[float, float, float]
    half_width_m: float


@dataclass(frozen=True, slots=True)
class SearchCell:
    """A square of the floor where a target may be: centre and side [m; world], probability as share of the most."""

    centre_m: tuple[float, float, float]
    side_m: float
    share: float


class ViewScene:
    """The scene by the messages so far; volumes: the boxes of motion capture and ranging
    systems [m; world]; top_m: height of texts about the whole scene.
    """

    def __init__(self, field: ResolvedField | None) -> None:
        self.field = field
        self.top_m = (0.0, 0.0, field.room.size_m[2] if field else _USUAL_HEIGHT_M)
        self.cameras: tuple[Transform, ...] = camera_frames(field) if field else ()
        targets = field.tracked if field else {}
        self._target_heights_m = {name: target.marker.height_m for name, target in targets.items()}
        self._colours = colours_of(field.drones, targets) if field else {}
        self.volumes: dict[str, Sides] = _volumes(field) if field else {}
        self.obstacles: dict[str, Sides] = _obstacles(field) if field else {}
        self._places = {one.child: one.position_m for one in self.cameras if one.parent == "world"}
        self._places |= {name: (sum(x) / 2, sum(y) / 2, z[1]) for name, (x, y, z) in self.volumes.items()}
        self.bodies: dict[str, Body] = {}

    def colour(self, name: str) -> Rgb:
        """Return the colour of a robot or a target: its shade for dark ground, which these viewers have by default."""
        return rgb(self._colours.get(name, NEUTRAL_COLOUR).dark)

    def take_estimate(self, message: m.Estimate) -> list[Body]:
        """Return the bodies of an estimate, and remember them."""
        found = [self._body(entity) for entity in message.entities]
        self.bodies.update((body.name, body) for body in found)
        return found

    def _body(self, entity: m.EntityEstimate) -> Body:
        size, mean = len(entity.mean), entity.mean
        has_pose = size >= 4
        height = mean[2] if has_pose else self._target_heights_m.get(entity.name, 0.0)
        position = (mean[0], mean[1], height)
        covariance = np.asarray(entity.covariance).reshape(size, size)
        return Body(entity.name, not has_pose, position, mean[3] if has_pose else 0.0, covariance[:2, :2])

    def cells(self, message: m.SearchMap) -> list[SearchCell]:
        """Return the cells of a map with a relevant probability of a target."""
        (x, y), side = message.first_m, message.cell_m
        height = self._target_heights_m.get(message.header.entity, 0.0)
        found = [(divmod(index, message.columns), chance / 255) for index, chance in enumerate(message.chances)]
        return [
            SearchCell((x + column * side, y + row * side, height), side, share)
            for (row, column), share in found
            if share > _LIKELY_AT_ALL
        ]

    def links(self, plan: m.Plan) -> list[SensingLink]:
        """Return the edges of a plan whose ends have a known place."""
        found = []
        for edge in plan.edges:
            begin, end = self._place(edge.observer), self._place(edge.subject)
            if begin is not None and end is not None:
                width = 0.004 * (1.0 + math.log10(1.0 + max(0.0, edge.information)))
                found.append(SensingLink(f"{edge.observer} sees {edge.subject}", begin, end, width))
        return found

    def _place(self, name: str) -> tuple[float, float, float] | None:
        body = self.bodies.get(name)
        return body.position_m if body is not None else self._places.get(name)

    def arrow(self, setpoint: m.VelocitySetpoint) -> tuple[Array, Array] | None:
        """Return (origin, vector) [m; world] of a commanded velocity, or None if the robot's place is unknown."""
        body = self.bodies.get(setpoint.header.entity)
        if body is None:
            return None
        forward, left, up = setpoint.velocity_m_s
        c, s = math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        vector = np.array([c * forward - s * left, s * forward + c * left, up])
        return np.array(body.position_m), ARROW_S * vector


def _obstacles(field: ResolvedField) -> dict[str, Sides]:
    boxes = zip(field.room.obstacles, boxes_from_field(field), strict=True)
    return {name: (box.outline.x_m, box.outline.y_m, (0.0, box.size_m[2])) for name, box in boxes}


def _volumes(field: ResolvedField) -> dict[str, Sides]:
    return {name: (box.x_m, box.y_m, box.z_m) for name, box in field.volumes.items()}

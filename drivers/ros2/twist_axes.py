"""Judges in whose axes a node states its velocity, by the way that its own position takes meanwhile. Pure.

Many nodes (a simulator's true odometry, some bridges) fill in the twist in the axes of the room, under the name of the
vehicle's frame.
"""

import math
from dataclasses import dataclass

from groundstation.bus.messages import Vector3
from groundstation.time_units import NS_PER_S

_WAY_M, _LONGEST_S = 0.4, 3.0
# Messages further apart than this end a stretch.
_GAP_S = 0.3
# Of the way: what fits, and what does not. The two readings differ by half of it from a heading of 30 degrees on.
_FITS, _DIFFERS = 0.25, 0.5
_STRETCHES = 3

Plane = tuple[float, float]


@dataclass(slots=True)
class TwistAxes:
    """Follows one publisher's odometry, in stretches of 0.4 m; wrong: its twist is in the axes of the room.

    Three stretches, with none in between that fit the vehicle's own axes, say so; a position that jumps or stands
    says nothing.
    """

    wrong: bool = False
    _last_s: float = -math.inf
    _began_s: float = 0.0
    _from: Plane = (0.0, 0.0)
    _own: Plane = (0.0, 0.0)
    _room: Plane = (0.0, 0.0)
    _against: int = 0

    def take(self, at_ns: int, position: Vector3, twist: Vector3, along: Vector3, yaw: float) -> None:
        """Take a message: its position [m], its twist as it is, and levelled along the heading [m/s], heading [rad]."""
        at_s = at_ns / NS_PER_S
        dt_s, self._last_s = at_s - self._last_s, at_s
        if not 0.0 < dt_s <= _GAP_S:
            self._begin(at_s, position)
            return
        c, s = math.cos(yaw), math.sin(yaw)
        forward, left, _ = along
        self._own = _moved(self._own, (c * forward - s * left, s * forward + c * left), dt_s)
        self._room = _moved(self._room, (twist[0], twist[1]), dt_s)
        way = (position[0] - self._from[0], position[1] - self._from[1])
        if math.hypot(*way) >= _WAY_M:
            self._judge(way)
            self._begin(at_s, position)
        elif at_s - self._began_s > _LONGEST_S:
            self._begin(at_s, position)

    def _begin(self, at_s: float, position: Vector3) -> None:
        self._began_s, self._from = at_s, (position[0], position[1])
        self._own = self._room = (0.0, 0.0)

    def _judge(self, way: Plane) -> None:
        length = math.hypot(*way)
        own, room = (math.dist(way, one) / length for one in (self._own, self._room))
        if own <= _FITS:
            self._against = 0
        elif room <= _FITS and own >= _DIFFERS:
            self._against += 1
        self.wrong = self.wrong or self._against >= _STRETCHES


def _moved(place: Plane, velocity: Plane, dt_s: float) -> Plane:
    return place[0] + velocity[0] * dt_s, place[1] + velocity[1] * dt_s

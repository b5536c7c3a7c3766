"""Keeps hovering robots, on HOLD or until TRACK, at the place where each came to rest. Pure."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from groundstation.bus.messages import KEPT_IN_PLACE, Vector3, VehicleStatus
from groundstation.control.output_limiter import Limited
from groundstation.control.parameters import SafetyParameters
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.geometry.stabilized_frame import stabilized_from_world
from groundstation.planning.parameters import MotionLimits
from groundstation.time_units import NS_PER_MS
from groundstation.vectors import Bounds

_HOVERS = frozenset({"HOVER", "HOLD"})  # a driver's modes in which the drone hovers for an order
# A drone at its maximum speed comes to rest within a second, and then reports that too.
_SETTLES_NS = 1500 * NS_PER_MS
# Places are known to 0.03 m: no drone is moved for less, nor for the noise of its place.
_LEAVES_M, _ARRIVES_M = 0.1, 0.03
_GAIN_PER_S, _MOST_M_S = 0.8, 0.2
# The vehicle keeps its own height, which is known less well; it climbs or sinks with the surface that it takes for the
# floor.
_LEAVES_UP_M, _ARRIVES_UP_M = 0.2, 0.05
# No drone drifts or climbs so far while it is brought back: beyond this the estimate is, or was, wrong.
_LEASH_M, _LEASH_UP_M = 0.5, 1.0
# Two sightings in sequence may be lost. A drone unseen for longer holds itself as well as the belief could.
_SEEN_S = 1.0
_STILL: Vector3 = (0.0, 0.0, 0.0)


@dataclass(slots=True)
class _Stay:
    """A robot's hover: the place to hold [x, y, z; world], once it has come to rest; returning, levelling: it is
    brought back to that, or to its height."""

    mode: str
    since_ns: int
    place: Vector3 | None = None
    returning: bool = False
    levelling: bool = False

    def back(self, now_ns: int, here: Vector3, room: Bounds | None) -> Vector3:
        """Return the velocity to the place [m/s; world], zero near it and until the robot has come to rest.

        room: where a place may be [m; world].
        """
        x, y, z = here
        if now_ns - self.since_ns < _SETTLES_NS:
            return _STILL
        if self.place is None or math.dist(self.place[:2], (x, y)) > _LEASH_M or abs(self.place[2] - z) > _LEASH_UP_M:
            self.place, self.returning, self.levelling = _within(room, here), False, False
        dx, dy, dz = self.place[0] - x, self.place[1] - y, self.place[2] - z
        off_m = math.hypot(dx, dy)
        self.returning = off_m > (_ARRIVES_M if self.returning else _LEAVES_M)
        self.levelling = abs(dz) > (_ARRIVES_UP_M if self.levelling else _LEAVES_UP_M)
        gain = min(_GAIN_PER_S, _MOST_M_S / off_m) if self.returning else 0.0
        climb = min(_GAIN_PER_S, _MOST_M_S / abs(dz)) if self.levelling else 0.0
        return gain * dx, gain * dy, climb * dz


class Hovering:
    """Use: `take` every status; at each tick pass all setpoints through `held`, limit them `within`, then `sent`.

    A robot that may stray, or waits after a pause of the tracker, hovers by itself, and so does one of doubtful place.
    level: robots that hold their height by our estimate, and of a way back obey the horizontal part only. safety: of
    the fence, in which places to hold are chosen; None: there is none.
    """

    def __init__(self, level: Collection[str] = (), safety: SafetyParameters | None = None) -> None:
        self._level, self._room = frozenset(level), None if safety is None else _room(safety)
        self._stays: dict[str, _Stay] = {}

    def take(self, status: VehicleStatus, now_ns: int) -> None:
        """Take a driver's mode: an order to hover begins a stay, each further one a new one."""
        name, mode = status.header.entity, status.mode
        if mode not in _HOVERS or status.failsafe not in KEPT_IN_PLACE:
            self._stays.pop(name, None)
        elif name not in self._stays or self._stays[name].mode != mode:
            self._stays[name] = _Stay(mode, now_ns)

    def held(
        self, wanted: Mapping[str, Setpoint], now_ns: int, belief: JointBelief, seen_s: Mapping[str, float]
    ) -> dict[str, Setpoint]:
        """Return the setpoints, those of hovering robots replaced by velocities back to their places.

        seen_s: time since each robot was seen whose place is not doubted [s].
        """
        return {name: self._held(name, one, now_ns, belief, seen_s) for name, one in wanted.items()}

    def within(self, safety: SafetyParameters) -> SafetyParameters:
        """Return the settings with each hovering robot's limits replaced by those within which its driver moves it."""
        return replace(safety, limits={**safety.limits, **{name: self._limits(name, safety) for name in self._stays}})

    def _limits(self, name: str, safety: SafetyParameters) -> MotionLimits:
        # What the limiter finds must be what moves the robot: cut down after that, it could lead through a wall.
        usual = safety.limits_of(name)
        climb = 0.0 if name in self._level else min(_MOST_M_S, usual.max_climb_m_s)
        return replace(usual, max_speed_m_s=min(_MOST_M_S, usual.max_speed_m_s), max_climb_m_s=climb)

    def sent(self, limited: Mapping[str, Limited], seen_s: Mapping[str, float]) -> dict[str, Limited]:
        """Return the setpoints to send after limiting: a hovering robot moves only while it is seen."""
        return {name: _sent(one, _is_sure(name, seen_s)) if name in self._stays else one
                for name, one in limited.items()}  # fmt: skip

    def _held(
        self, name: str, setpoint: Setpoint, now_ns: int, belief: JointBelief, seen_s: Mapping[str, float]
    ) -> Setpoint:
        stay = self._stays.get(name)
        if stay is None:
            return setpoint
        velocity = _STILL
        if name in belief.layout and _is_sure(name, seen_s):
            x, y, z, yaw = belief.mean_of(name)[:4].tolist()
            back = stay.back(now_ns, (x, y, z), self._room)
            forward, left, up = stabilized_from_world(np.array(back), yaw).tolist()
            velocity = (forward, left, 0.0 if name in self._level else up)
        return replace(setpoint, velocity_m_s=velocity, yaw_rate_rad_s=0.0)


def _room(safety: SafetyParameters) -> Bounds:
    """Return where places to hold may be [m; world]: in the fence, by the limiter's margin; the bottom counts not."""
    (west, east), (south, north), (_, top) = safety.fence
    kept_m = safety.margin_m
    return (west + kept_m, east - kept_m), (south + kept_m, north - kept_m), (-math.inf, top - kept_m)


def _within(room: Bounds | None, place: Vector3) -> Vector3:
    """Return the nearest place in a room."""
    if room is None:
        return place
    x, y, z = (max(low, min(high, at)) for (low, high), at in zip(room, place, strict=True))
    return x, y, z


def _sent(limited: Limited, sure: bool) -> Limited:
    velocity = limited.setpoint.velocity_m_s if sure else _STILL
    setpoint = replace(limited.setpoint, velocity_m_s=velocity, yaw_rate_rad_s=0.0)
    return replace(limited, setpoint=setpoint, holds=math.hypot(*velocity) > 0.0)


def _is_sure(name: str, seen_s: Mapping[str, float]) -> bool:
    return seen_s.get(name, math.inf) <= _SEEN_S

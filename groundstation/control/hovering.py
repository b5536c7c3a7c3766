"""Keeps robots that hover, on HOLD or until TRACK, at the place where each came to rest. Pure."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from groundstation.bus.messages import Vector3, VehicleStatus
from groundstation.control.output_limiter import Limited
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.geometry.stabilized_frame import stabilized_from_world
from groundstation.time_units import NS_PER_MS

_HOVERS = frozenset({"HOVER", "HOLD"})  # a driver's modes in which the drone hovers for an order
# From its greatest speed a drone stands after a second, and says so.
_SETTLES_NS = 1500 * NS_PER_MS
# Places are known to 0.03 m: nobody is moved for less, nor for the noise of it.
_LEAVES_M, _ARRIVES_M = 0.1, 0.03
_GAIN_PER_S, _MOST_M_S = 0.8, 0.2
# Nobody drifts as far while it is brought back: the belief was wrong, or is.
_LEASH_M = 0.5
# Two sightings in sequence may be lost. Unseen for longer, its own hover knows as much as the belief.
_SEEN_S = 1.0
_STILL: Vector3 = (0.0, 0.0, 0.0)


@dataclass(slots=True)
class _Stay:
    """A robot's hover: the place to hold [x, y; world], once it has come to rest; returning: it is brought back."""

    mode: str
    since_ns: int
    place: tuple[float, float] | None = None
    returning: bool = False

    def back(self, now_ns: int, x: float, y: float) -> tuple[float, float]:
        """Return the velocity to the place [m/s; world], zero near it and until the robot has come to rest."""
        if now_ns - self.since_ns < _SETTLES_NS:
            return 0.0, 0.0
        if self.place is None or math.dist(self.place, (x, y)) > _LEASH_M:
            self.place, self.returning = (x, y), False
        dx, dy = self.place[0] - x, self.place[1] - y
        off_m = math.hypot(dx, dy)
        self.returning = off_m > (_ARRIVES_M if self.returning else _LEAVES_M)
        if not self.returning:
            return 0.0, 0.0
        gain = min(_GAIN_PER_S, _MOST_M_S / off_m)
        return gain * dx, gain * dy


class Hovering:
    """Use: `take` every status; at each tick pass all setpoints through `held` before they are limited, `sent` after.

    A robot that a failsafe stopped hovers by itself, and so does one of doubtful place.
    """

    def __init__(self) -> None:
        self._stays: dict[str, _Stay] = {}

    def take(self, status: VehicleStatus, now_ns: int) -> None:
        """Take a driver's mode: an order to hover begins a stay, each further one a new one."""
        name, mode = status.header.entity, status.mode
        if mode not in _HOVERS or status.failsafe:
            self._stays.pop(name, None)
        elif name not in self._stays or self._stays[name].mode != mode:
            self._stays[name] = _Stay(mode, now_ns)

    def held(
        self, wanted: Mapping[str, Setpoint], now_ns: int, belief: JointBelief, seen_s: Mapping[str, float]
    ) -> dict[str, Setpoint]:
        """Return the setpoints, those of hovering robots replaced by what brings each back to its place.

        seen_s: time since each robot was seen whose place is not doubted [s].
        """
        return {name: self._held(name, one, now_ns, belief, seen_s) for name, one in wanted.items()}

    def sent(self, limited: Mapping[str, Limited], seen_s: Mapping[str, float]) -> dict[str, Limited]:
        """Return what is sent after limiting: who hovers moves sideways only, and only while it is seen."""
        return {name: self._sent(one, _is_sure(name, seen_s)) if name in self._stays else one
                for name, one in limited.items()}  # fmt: skip

    def _held(
        self, name: str, setpoint: Setpoint, now_ns: int, belief: JointBelief, seen_s: Mapping[str, float]
    ) -> Setpoint:
        stay = self._stays.get(name)
        if stay is None:
            return setpoint
        velocity = _STILL
        if name in belief.layout and _is_sure(name, seen_s):
            x, y, _, yaw = belief.mean_of(name)[:4].tolist()
            back = np.array((*stay.back(now_ns, x, y), 0.0))
            forward, left, _ = stabilized_from_world(back, yaw).tolist()
            velocity = (forward, left, 0.0)
        return replace(setpoint, velocity_m_s=velocity, yaw_rate_rad_s=0.0)

    def _sent(self, limited: Limited, sure: bool) -> Limited:
        forward, left, _ = limited.setpoint.velocity_m_s if sure else _STILL
        setpoint = replace(limited.setpoint, velocity_m_s=(forward, left, 0.0), yaw_rate_rad_s=0.0)
        return replace(limited, setpoint=setpoint, holds=math.hypot(forward, left) > 0.0)


def _is_sure(name: str, seen_s: Mapping[str, float]) -> bool:
    return seen_s.get(name, math.inf) <= _SEEN_S

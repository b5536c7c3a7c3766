"""The physical limits of a kind of vehicle, as data: a value beyond them is no measurement."""

import math
from dataclasses import dataclass

from drivers.plausibility.health import Sensor


@dataclass(frozen=True, slots=True)
class PlausibilityLimits:
    """Limits of one kind of vehicle.

    frozen_s: how long all values may repeat; stuck_s: how long one sensor may while others move; stuck_alone_s:
    likewise at any tilt; stuck_m_s: change of speed that the tilt must imply meanwhile. clock_stands_s,
    clock_suspect_s, clock_late_s: how long the vehicle's clock may stand, and how much older than the freshest its
    values may be. speed_m_s, tilt_rad: beyond the vehicle's means, BAD after beyond_s. jump_m_s, acceleration_m_s2 and
    jump_rad, turn_rad_s: the largest step between two values, at once and by time. jumps, jumps_within_s: number of
    such steps that is too many within a time. hold_s: how long a verdict outlives its evidence. clock_wrap_s: time at
    which the vehicle's clock starts over. stirs_on_floor: the noise of its inertial values shows while it stands.
    essential: sensors without which the vehicle cannot fly.
    """

    frozen_s: float = 0.3
    stuck_s: float = 0.5
    stuck_alone_s: float = 0.7
    stuck_m_s: float = 0.05
    clock_stands_s: float = 0.3
    clock_suspect_s: float = 0.3
    clock_late_s: float = 1.0
    speed_m_s: float = 5.0
    tilt_rad: float = math.radians(40.0)
    beyond_s: float = 0.2
    jump_m_s: float = 0.4
    acceleration_m_s2: float = 15.0
    jump_rad: float = math.radians(10.0)
    turn_rad_s: float = math.radians(500.0)
    jumps: int = 3
    jumps_within_s: float = 1.0
    hold_s: float = 1.0
    clock_wrap_s: float | None = None
    stirs_on_floor: bool = True
    essential: frozenset[Sensor] = frozenset({Sensor.TELEMETRY, Sensor.CLOCK, Sensor.VELOCITY, Sensor.ATTITUDE})

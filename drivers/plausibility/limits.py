"""What a kind of vehicle can do, as data: beyond it a value is no measurement."""

import math
from dataclasses import dataclass

from drivers.plausibility.health import Sensor


@dataclass(frozen=True, slots=True)
class PlausibilityLimits:
    """Limits of one kind of vehicle.

    frozen_s: all values repeat for so long; stuck_s: one sensor does while others move; stuck_alone_s: whatever the
    tilt says; stuck_m_s: change of speed that the tilt must account for meanwhile. clock_stands_s, clock_suspect_s,
    clock_late_s: the vehicle's clock stands, or its values are older than the freshest ones by so much.
    speed_m_s, tilt_rad: beyond the vehicle's means, for beyond_s. jump_m_s, acceleration_m_s2 and jump_rad,
    turn_rad_s: the largest step between two values, at once and by time. jumps, jumps_within_s: so many of them are too
    many. hold_s: how long a verdict outlives its evidence. clock_wrap_s: where the vehicle's clock starts over.
    essential: sensors without which nobody can fly.
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
    essential: frozenset[Sensor] = frozenset({Sensor.TELEMETRY, Sensor.CLOCK, Sensor.VELOCITY, Sensor.ATTITUDE})

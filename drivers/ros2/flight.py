"""Judges whether a vehicle flies, by its height and orders: no ROS 2 message reports it. Pure."""

import math
from dataclasses import dataclass

from drivers.rmw_zenoh.wire.vehicle import Quaternion, Vector3
from drivers.watchdog_types import Action
from groundstation.bus.messages import FlightState
from groundstation.geometry.angles import euler_from_quaternion
from groundstation.time_units import NS_PER_MS

_AIRBORNE_M, _STILL_M_S, _CLIMB_M_S = 0.2, 0.25, 0.15
_STANDS_NS = 500 * NS_PER_MS
# Meanwhile its height, averaged over a moment, changes by less than this: a slow descent is no stand.
_MOMENT_NS, _RESTS_M = 200 * NS_PER_MS, 0.03
_LEANS_RAD, _MOVES_M_S = math.radians(50.0), 1.0
# Share of the take-off height at which a take-off counts as finished.
_UP = 0.7
# While a vehicle is commanded one of these, a low height may be a low flight.
_FLOWN = frozenset({Action.FLY, Action.HOVER})


@dataclass(slots=True)
class FlightWatch:
    """Follows one vehicle; take_off_m: the height that its take-off climbs to.

    Lower than 0.2 m and still for 0.5 s it stands. Time for which it was commanded to fly does not count: a drifting
    height must not turn a flying vehicle into a standing one, which would not be landed.
    """

    take_off_m: float
    airborne: bool = False
    heard: bool = False
    climbed: bool = False
    _low_since_ns: int | None = None
    _rests_at_m: float = 0.0
    _mean_m: float = 0.0
    _at_ns: int = 0

    def see(self, now_ns: int, height_m: float, climb_m_s: float, asked: Action) -> None:
        """Take a height above its stand [m] and a climb rate [m/s]; asked: its present order."""
        self._mean_m += min(1.0, (now_ns - self._at_ns) / _MOMENT_NS) * (height_m - self._mean_m)
        self._at_ns = now_ns
        low = height_m < _AIRBORNE_M
        rests = low and abs(climb_m_s) <= _CLIMB_M_S and abs(self._mean_m - self._rests_at_m) <= _RESTS_M
        if not rests or asked in _FLOWN:
            self._low_since_ns, self._rests_at_m = None, self._mean_m
        elif self._low_since_ns is None:
            self._low_since_ns = now_ns
        stands = self._low_since_ns is not None and now_ns - self._low_since_ns >= _STANDS_NS
        if not low:
            self.airborne = True
        elif stands or not self.heard:
            self.airborne = False
        self.climbed = self.airborne and (self.climbed or asked is not Action.TAKE_OFF or self._is_up(height_m))
        self.heard = True

    def _is_up(self, height_m: float) -> bool:
        return height_m >= _UP * self.take_off_m

    def state(self, asked: Action, speed_m_s: float) -> FlightState:
        """Return the flight state for its present order and speed."""
        if not self.heard:
            return FlightState.UNKNOWN
        if not self.airborne:
            return FlightState.LANDED
        if asked is Action.LAND:
            return FlightState.LANDING
        if not self.climbed:
            return FlightState.TAKING_OFF
        return FlightState.HOVERING if asked is Action.HOVER and speed_m_s < _STILL_M_S else FlightState.FLYING


def fault_of_standing(height_m: float, velocity: Vector3, roll: float, pitch: float, standing_z_m: float) -> str:
    """Return why a standing vehicle's odometry is unfit for flight, with the remedy, or "".

    height_m: above standing_z_m; velocity [m/s] and angles [rad] as its odometry has them, levelled.
    """
    if height_m < -_AIRBORNE_M:
        return (
            f"its odometry says z = {height_m + standing_z_m:.2f} m where it stands: "
            f"set ros2.standing_z_m, which is {standing_z_m:g}"
        )
    if max(abs(roll), abs(pitch)) > _LEANS_RAD:
        leans = math.degrees(max(abs(roll), abs(pitch)))
        return f"its odometry says that it stands tilted by {leans:.0f} deg: its axes must be x ahead, y left, z up"
    if (speed_m_s := math.hypot(*velocity)) > _MOVES_M_S:
        return f"its odometry says {speed_m_s:.1f} m/s where it stands"
    return ""


def angles_of(xyzw: Quaternion) -> Vector3:
    """Return roll, pitch and yaw [rad; FLU: right side down, nose down, counter-clockwise positive]."""
    x, y, z, w = xyzw
    return euler_from_quaternion((w, x, y, z))


def levelled(velocity: Vector3, roll: float, pitch: float) -> Vector3:
    """Return a velocity of the vehicle's tilted axes along its heading, its left, and up [m/s]."""
    x, y, z = velocity
    left, up = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
    return x * math.cos(pitch) + up * math.sin(pitch), left, up * math.cos(pitch) - x * math.sin(pitch)

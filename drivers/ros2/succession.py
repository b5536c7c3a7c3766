"""Judges whose odometry counts: one publisher's; in flight a successor counts only if it continues the motion. Pure."""

import math
from dataclasses import dataclass, field

from drivers.rmw_zenoh.publisher_tie import PublisherTie
from drivers.rmw_zenoh.wire.vehicle import OdometryMessage
from drivers.ros2.flight import angles_of
from drivers.vehicle_settings import VehicleLimits
from groundstation.geometry.angles import difference
from groundstation.time_units import NS_PER_S

# Of two estimates of one vehicle, and of its drift while it hovers in silence.
_APART_M, _APART_UP_M, _APART_RAD = 0.3, 0.15, math.radians(15.0)
# It is told to hover 0.3 s after the last message, and has then to brake; it climbs slower, and brakes sooner.
_MOVES_S, _CLIMBS_S = 1.0, 0.5
# Later it may be landing: nobody can tell then whether another estimate continues the former one.
_REMEMBERED_NS = 3 * NS_PER_S
_STANDS_M = 0.2
# For so long after its last message a second publisher counts as present.
_PRESENT_NS = 3 * NS_PER_S


@dataclass(slots=True)
class Succession:
    """Follows the publishers of one vehicle's odometry; limits: of its motion; standing_z_m: z where it stands."""

    limits: VehicleLimits
    standing_z_m: float
    _tie: PublisherTie = field(default_factory=PublisherTie)
    _last: OdometryMessage | None = None
    _last_ns: int = 0
    _second_ns: int = 0

    def is_second(self, publisher: bytes, now_ns: int) -> bool:
        """Return whether a message comes from another publisher while the first one speaks."""
        if not self._tie.is_second(publisher, now_ns):
            return False
        self._second_ns = now_ns
        return True

    def two_speak(self, now_ns: int) -> bool:
        """Return whether a second publisher was heard just now."""
        return self._second_ns > 0 and now_ns - self._second_ns < _PRESENT_NS

    def break_with(self, now_ns: int, publisher: bytes, message: OdometryMessage) -> str:
        """Return how the message of an heir does not continue the last one in flight, or ""; of no heir: ""."""
        last, elapsed_ns = self._last, now_ns - self._last_ns
        if last is None or not self._tie.is_other(publisher):
            return ""
        if elapsed_ns > _REMEMBERED_NS:
            return f"{elapsed_ns / NS_PER_S:.0f} s after the last one"
        if message.frames != last.frames:
            return f"in {_named(message)}, not {_named(last)}"
        return self._step(last, message)

    def _step(self, last: OdometryMessage, message: OdometryMessage) -> str:
        (x, y, z), (last_x, last_y, last_z) = message.position, last.position
        if z - self.standing_z_m < _STANDS_M:
            return "it says that it stands"
        away_m, rise_m = math.hypot(x - last_x, y - last_y), z - last_z
        if away_m > _APART_M + self.limits.max_speed_m_s * _MOVES_S:
            return f"{away_m:.1f} m away"
        if abs(rise_m) > _APART_UP_M + self.limits.max_climb_m_s * _CLIMBS_S:
            return f"{abs(rise_m):.1f} m {'higher' if rise_m > 0.0 else 'lower'}"
        turn_rad = abs(difference(angles_of(message.quaternion)[2], angles_of(last.quaternion)[2]))
        if turn_rad > _APART_RAD + self.limits.max_yaw_rate_rad_s * _MOVES_S:
            return f"turned by {math.degrees(turn_rad):.0f} deg"
        return ""

    def take(self, now_ns: int, publisher: bytes, message: OdometryMessage) -> bool:
        """Keep the publisher and the content of a message that counts; returns whether it is a new publisher."""
        new = self._tie.take(publisher, now_ns)
        if new:
            self._second_ns = 0  # it was the second one: the first is gone
        self._last, self._last_ns = message, now_ns
        return new


def _named(message: OdometryMessage) -> str:
    frame, own = message.frames
    return f"frame '{frame}' of '{own}'"

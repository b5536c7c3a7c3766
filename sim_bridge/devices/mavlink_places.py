"""Places of setpoints and commands, in the world of an emulated MAVLink vehicle. Pure.

Places are metres: x north, y west, z up, as its estimate has them. Origins are (latitude, longitude) [deg x 1e7] and
altitude [mm].
"""

import math

from drivers.mavlink.wire.flight import SetPositionTargetGlobalInt, SetPositionTargetLocalNed
from groundstation.vectors import Vector3

Origin = tuple[int, int, int]
DEGREE_M = 111_318.845
_LOCAL, _OFFSET, _BODY, _BODY_OFFSET = 1, 7, 8, 9
_ABOVE_SEA, _ABOVE_HOME = frozenset({0, 5}), frozenset({3, 6})
_PLACE, _YAW = 1 | 2 | 4, 1024


def on_ground(origin: Origin, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
    """Return x and y of a place on Earth."""
    shrink = math.cos(math.radians(origin[0] * 1e-7))
    north, east = latitude_deg - origin[0] * 1e-7, longitude_deg - origin[1] * 1e-7
    return north * DEGREE_M, -east * DEGREE_M * shrink


def height_in(frame: int, origin: Origin, home_z_m: float, altitude_m: float) -> float | None:
    """Return z of an altitude in a frame of MAVLink, None in one that has none; home_z_m: z of the origin's ground."""
    if frame in _ABOVE_SEA:
        return altitude_m - origin[2] * 1e-3 + home_z_m
    return altitude_m + home_z_m if frame in _ABOVE_HOME else None


def local_place(setpoint: SetPositionTargetLocalNed, position: Vector3, yaw: float) -> Vector3 | None:
    """Return the place that a setpoint names whole, or None; position, yaw: of the vehicle.

    WIRE (ArduCopter 4.7, source): all frames but LOCAL_NED count from where the vehicle is, the body's by its heading.
    """
    s = setpoint
    if s.type_mask & _PLACE or not all(map(math.isfinite, (s.x, s.y, s.z))):
        return None
    x, y, z = s.x, -s.y, -s.z
    if s.coordinate_frame == _LOCAL:
        return x, y, z
    if s.coordinate_frame in (_BODY, _BODY_OFFSET):
        x, y = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
    return position[0] + x, position[1] + y, position[2] + z


def heading_of(setpoint: SetPositionTargetLocalNed) -> float | None:
    """Return the heading [rad] that a setpoint names, or None."""
    return None if setpoint.type_mask & _YAW or not math.isfinite(setpoint.yaw) else -setpoint.yaw


def as_local(setpoint: SetPositionTargetGlobalInt, origin: Origin, home_z_m: float) -> SetPositionTargetLocalNed | None:
    """Return a setpoint on Earth as one in the local frame, or None for a height that is in no known frame."""
    s, x, y, z = setpoint, 0.0, 0.0, 0.0
    if not s.type_mask & _PLACE:
        height = height_in(s.coordinate_frame, origin, home_z_m, s.alt)
        if height is None:
            return None
        x, y = on_ground(origin, s.lat_int * 1e-7, s.lon_int * 1e-7)
        z = height
    head = (s.time_boot_ms, s.target_system, s.target_component, _LOCAL, s.type_mask)
    return SetPositionTargetLocalNed(*head, x, -y, -z, *setpoint[8:])

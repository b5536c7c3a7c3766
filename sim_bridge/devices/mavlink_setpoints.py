"""SET_POSITION_TARGET_LOCAL_NED as each firmware reads it. Pure.

Places are read by `mavlink_places.py`. An acceleration is a setpoint too, at which the emulated vehicles hover.
"""

import math
from enum import Enum

from drivers.mavlink.wire.flight import SetPositionTargetLocalNed

Velocity = tuple[float, float, float]
_LOCAL, _BODY = 1, 8
_COPTER_FRAMES = frozenset({1, 7, 8, 9})
_POSITION, _VELOCITY, _ACCELERATION = (1, 2, 4), (8, 16, 32), (64, 128, 256)
_FORCE = 512
_FASTEST_M_S = 1000.0
_HOVER: Velocity = (0.0, 0.0, 0.0)


class Verdict(Enum):
    """What a setpoint that is not obeyed does to an ArduPilot."""

    STOP = "stop"
    NOTHING = "nothing"


def read_by_px4(setpoint: SetPositionTargetLocalNed) -> Velocity | str:
    """Return a setpoint's velocity [frame of the setpoint], or the text with which a PX4 refuses it.

    WIRE (PX4 1.15, source): each axis counts by itself, unless it is ignored or no number. In the body's frame only
    whole velocities count, and no places.
    """
    s, name = setpoint, "SET_POSITION_TARGET_LOCAL_NED"
    if s.coordinate_frame not in (_LOCAL, _BODY):
        return f"{name} coordinate frame {s.coordinate_frame} unsupported"
    whole = s.coordinate_frame == _BODY
    velocity = _axes(s.type_mask, _VELOCITY, (s.vx, s.vy, s.vz), whole)
    acceleration = _axes(s.type_mask, _ACCELERATION, (s.afx, s.afy, s.afz), whole)
    place = [] if whole else _axes(s.type_mask, _POSITION, (s.x, s.y, s.z), whole)
    if any(map(math.isfinite, acceleration)) and s.type_mask & _FORCE:
        return f"{name} force not supported"
    if not any(map(math.isfinite, (*velocity, *acceleration, *place))):
        return f"{name} invalid"
    x, y, z = (value if math.isfinite(value) else 0.0 for value in velocity)
    return x, y, z


def _axes(mask: int, bits: tuple[int, ...], values: Velocity, whole: bool) -> list[float]:
    if whole and mask & sum(bits):
        return [math.nan] * 3
    return [math.nan if mask & bit else value for bit, value in zip(bits, values, strict=True)]


def read_by_ardupilot(setpoint: SetPositionTargetLocalNed) -> Velocity | Verdict:
    """Return its velocity [its own frame], or what an ArduCopter in GUIDED does instead of obeying.

    WIRE (ArduCopter 4.5, source): by groups of three axes; one ignored axis ignores its group. A wrong frame, a
    velocity that is none, and nothing to do make it stop; a force, nothing.
    """
    s = setpoint
    if s.coordinate_frame not in _COPTER_FRAMES:
        return Verdict.STOP
    place, velocity, acceleration = (not s.type_mask & sum(bits) for bits in (_POSITION, _VELOCITY, _ACCELERATION))
    if acceleration and s.type_mask & _FORCE:
        return Verdict.NOTHING
    if velocity and not all(abs(v) <= _FASTEST_M_S for v in (s.vx, s.vy, s.vz)):
        return Verdict.STOP
    if velocity and not place:
        return s.vx, s.vy, s.vz
    return _HOVER if velocity or place != acceleration else Verdict.STOP

"""True state of a vehicle from the simulator behind its firmware, in the order of the dialect.

No driver uses these: they are for programs that show where a simulated vehicle really is.
"""

from typing import NamedTuple


class SimState(NamedTuple):
    """True state, as ArduPilot's simulator sends it when asked: rad, m/s, m; degrees, and degrees x 1e7 (*_int)."""

    q1: float
    q2: float
    q3: float
    q4: float
    roll: float
    pitch: float
    yaw: float
    xacc: float
    yacc: float
    zacc: float
    xgyro: float
    ygyro: float
    zgyro: float
    lat: float
    lon: float
    alt: float
    std_dev_horz: float
    std_dev_vert: float
    vn: float
    ve: float
    vd: float
    lat_int: int = 0
    lon_int: int = 0


class HilStateQuaternion(NamedTuple):
    """True state, as PX4's SIH sends it on a port of its own: w x y z, rad/s, degrees x 1e7, mm, cm/s, mG."""

    time_usec: int
    attitude_quaternion: tuple[float, ...]
    rollspeed: float
    pitchspeed: float
    yawspeed: float
    lat: int
    lon: int
    alt: int
    vx: int
    vy: int
    vz: int
    ind_airspeed: int
    true_airspeed: int
    xacc: int
    yacc: int
    zacc: int

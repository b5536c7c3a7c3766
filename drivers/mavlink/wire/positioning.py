"""Position by satellites, in the order of the dialect; programs for outdoor flight wait for it."""

from typing import NamedTuple


class GpsRawInt(NamedTuple):
    """State of the receiver: fix 0 no receiver, 1 none, 3 in space; degrees x 1e7, mm, cm/s, cdeg; 65535 unknown."""

    time_usec: int
    fix_type: int
    lat: int
    lon: int
    alt: int
    eph: int
    epv: int
    vel: int
    cog: int
    satellites_visible: int
    alt_ellipsoid: int = 0
    h_acc: int = 0
    v_acc: int = 0
    vel_acc: int = 0
    hdg_acc: int = 0
    yaw: int = 0


class GlobalPositionInt(NamedTuple):
    """Its estimated position: degrees x 1e7, mm, cm/s in north-east-down, cdeg."""

    time_boot_ms: int
    lat: int
    lon: int
    alt: int
    relative_alt: int
    vx: int
    vy: int
    vz: int
    hdg: int

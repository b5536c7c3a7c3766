"""Parameters that indoor flight on our position needs, and what is wrong with those a vehicle has.

Sources: docs/reference/mavlink.md 1.1, 2 (flown), docs/reference/mavlink.md 5.2, 5.3 (failsafes).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.parameters import INT32, REAL32


@dataclass(frozen=True, slots=True)
class Needed:
    """One parameter: its value, how it travels, and what it is for."""

    name: str
    value: float
    reason: str
    kind: int = INT32


_PX4 = (
    Needed("EKF2_GPS_CTRL", 0, "no GPS indoors"),
    Needed("EKF2_EV_CTRL", 11, "position, height and heading come from outside; velocity does not"),
    Needed("EKF2_HGT_REF", 3, "height comes from outside"),
    Needed("EKF2_MAG_TYPE", 5, "no compass near steel"),
    Needed("EKF2_EV_DELAY", 0, "poses are sent as predicted to now", REAL32),
    Needed("SYS_HAS_GPS", 0, "arm without GPS"),
    Needed("COM_OF_LOSS_T", 1.0, "time without set-points before the failsafe", REAL32),
    Needed("COM_OBL_RC_ACT", 4, "that failsafe: land"),
    Needed("COM_RC_IN_MODE", 4, "no stick"),
    Needed("COM_RCL_EXCEPT", 4, "offboard flight needs no stick"),
    Needed("COM_DISARM_LAND", 2.0, "motors off after touch-down", REAL32),
)
_ARDUPILOT = (
    Needed("VISO_TYPE", 1, "position from outside, by MAVLink"),
    Needed("GPS1_TYPE", 0, "no GPS indoors"),
    Needed("EK3_SRC1_POSXY", 6, "position comes from outside"),
    Needed("EK3_SRC1_VELXY", 6, "as flown; no velocity is fed"),
    Needed("EK3_SRC1_POSZ", 6, "height comes from outside"),
    Needed("EK3_SRC1_VELZ", 6, "as flown; no velocity is fed"),
    Needed("EK3_SRC1_YAW", 6, "heading comes from outside"),
    Needed("COMPASS_USE", 0, "no compass near steel"),
    Needed("COMPASS_USE2", 0, "no compass near steel"),
    Needed("COMPASS_USE3", 0, "no compass near steel"),
    Needed("ARMING_CHECK", 1048574, "all checks but the GPS's"),
    Needed("GUID_TIMEOUT", 0.5, "time without set-points before it stops", REAL32),
    Needed("FS_GCS_ENABLE", 5, "ground station lost: land"),
    Needed("FS_GCS_TIMEOUT", 5.0, "time without our heartbeat before that", REAL32),
    Needed("FS_EKF_ACTION", 1, "position lost: land"),
    Needed("FS_THR_ENABLE", 0, "no stick"),
)


def needed(flavour: Flavour, our_system: int) -> tuple[Needed, ...]:
    """Return what a vehicle of a flavour must be set to, when this ground station has a system id."""
    if flavour is Flavour.PX4:
        return _PX4
    # WIRE (docs/reference/mavlink.md 1): only heartbeats from SYSID_MYGCS keep the ground-station failsafe quiet.
    return (*_ARDUPILOT, Needed("SYSID_MYGCS", our_system, "the ground station whose heartbeat counts"))


def difference(wanted: Needed, found: Mapping[str, float]) -> str:
    """Return what is wrong with one parameter, or ""."""
    if wanted.name not in found:
        return f"{wanted.name} is missing, needs {wanted.value:g} ({wanted.reason})"
    have = found[wanted.name]
    if abs(have - wanted.value) <= 1e-4 * max(1.0, abs(wanted.value)):
        return ""
    return f"{wanted.name} is {have:g}, needs {wanted.value:g} ({wanted.reason})"

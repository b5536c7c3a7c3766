"""Parameters needed for indoor flight on our position, and a vehicle's differences from them.

Reasons and sources, one by one: docs/reference/mavlink.md 5.4.1. Checked with PX4 1.16 and ArduCopter 4.6 and 4.7.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.parameters import INT32, REAL32

Version = tuple[int, int]
# Releases whose parameters were compared with the tables below: first and last of each flavour.
_CHECKED: dict[Flavour, tuple[Version, Version]] = {
    Flavour.PX4: ((1, 16), (1, 16)),
    Flavour.ARDUPILOT: ((4, 6), (4, 7)),
}


@dataclass(frozen=True, slots=True)
class Needed:
    """One parameter: the value that `setup` writes, its type on the wire, and its purpose.

    accepted: lowest and highest value that are acceptable too; others: acceptable single values; flown: a wider range
    that permits a take-off, but is reported to the operator and changed by `setup`; aliases: names in other releases;
    successor: the parameter that replaces it in later releases, with another unit or meaning; optional: a firmware
    without it flies; bits: only these of a mask must be set, `setup` keeps the others.
    """

    name: str
    value: float
    reason: str
    kind: int = INT32
    accepted: tuple[float, float] | None = None
    others: tuple[float, ...] = ()
    flown: tuple[float, float] | None = None
    aliases: tuple[str, ...] = ()
    optional: bool = False
    bits: int = 0
    successor: "Needed | None" = None

    @property
    def names(self) -> tuple[str, ...]:
        """Return its name, its aliases and those of its successor."""
        return (self.name, *self.aliases, *(self.successor.names if self.successor is not None else ()))

    def under(self, name: str) -> "Needed":
        """Return the need that a name of it has: its own, or its successor's."""
        later = self.successor
        return later if later is not None and name in later.names else self

    def takes(self, value: float) -> bool:
        """Return whether a value is acceptable; one that is no number never is."""
        if not math.isfinite(value):
            return False
        if self.bits:
            return round(value) & self.bits == self.bits
        in_range = _lies_in(self.accepted or (self.value, self.value), value)
        return in_range or any(_lies_in((other, other), value) for other in self.others)

    def forbids(self, value: float) -> bool:
        """Return whether a value forbids a take-off."""
        return not (self.takes(value) or (self.flown is not None and _lies_in(self.flown, value)))

    def mending(self, value: float | None) -> "Needed":
        """Return it with the value to write in place of another one."""
        if value is None or not self.bits or not math.isfinite(value):
            return self
        return replace(self, value=round(value) | self.bits)

    @property
    def wish(self) -> str:
        """Return its permitted values, in words."""
        if self.bits:
            return f"{self.bits} in its sum"
        if self.accepted is not None:
            return f"{self.accepted[0]:.7g} to {self.accepted[1]:.7g}"
        return " or ".join(f"{value:.7g}" for value in (self.value, *self.others))


def _lies_in(span: tuple[float, float], value: float) -> bool:
    tolerance = 1e-4 * max(1.0, abs(value))
    return span[0] - tolerance <= value <= span[1] + tolerance


_NO_RETURN = "a return would climb first, to the ceiling"
_CLIMBS_ON = "faster, it climbs on for metres when it is landed from a climb that others ordered"
_IN_TIME = "down in time where it lands without a position"
_CENTRE = "our positions are those of its centre"
LOSS = "FS_THR_ENABLE"  # how an ArduPilot reacts to the loss of its transmitter; 0: not at all, and tells nobody
# WIRE (ArduCopter 4.7, radio.cpp): with 0 a receiver without its transmitter counts as healthy for ever.
_RECEIVES = Needed(LOSS, 3, f"with 0 it never tells a lost transmitter, so no pilot counts; {_NO_RETURN}", flown=(0, 0))


def _offsets(stem: str) -> tuple[Needed, ...]:
    return tuple(Needed(f"{stem}_{axis}", 0, _CENTRE, REAL32, optional=True) for axis in "XYZ")


_PX4 = (
    Needed("EKF2_GPS_CTRL", 0, "no GPS indoors"),
    Needed("EKF2_EV_CTRL", 11, "position, height and heading come from outside; velocity does not"),
    Needed("EKF2_HGT_REF", 3, "height comes from outside"),
    Needed("EKF2_RNG_CTRL", 0, "a distance sensor would replace our height as the reference"),
    Needed("EKF2_MAG_TYPE", 5, "no compass near steel"),
    Needed("EKF2_EV_DELAY", 0, "poses are sent as predicted to now", REAL32, accepted=(0, 50)),
    *_offsets("EKF2_EV_POS"),
    Needed("EKF2_EVP_NOISE", 0.03, "lower bound of the error of our positions, 1 to 3 cm", REAL32, (0.01, 0.06)),
    Needed("EKF2_IMU_CTRL", 3, "it must not take its thrust for gravity while no position comes", others=(0, 1, 2)),
    Needed("EKF2_NOAID_TOUT", 900_000, "without our positions it lands level, not by its velocity", INT32, (5e5, 9e5)),
    Needed("SYS_HAS_GPS", 0, "arm without GPS"),
    Needed("COM_OF_LOSS_T", 0.5, "time without setpoints before the failsafe", REAL32, accepted=(0.3, 1.0)),
    Needed("COM_OBL_RC_ACT", 4, "that failsafe: land"),
    Needed("COM_RC_IN_MODE", 0, "a transmitter's kill and mode switches stay alive, whatever a joystick does"),
    Needed("COM_RCL_EXCEPT", 4, "offboard flight needs no stick", others=(5, 6, 7)),
    Needed("COM_LOW_BAT_ACT", 2, _NO_RETURN, others=(0,)),
    Needed("COM_FLTT_LOW_ACT", 1, _NO_RETURN, others=(0,), flown=(0, 3), optional=True),
    Needed("NAV_RCL_ACT", 3, _NO_RETURN, others=(1,), flown=(0, 3)),
    Needed("NAV_DLL_ACT", 0, _NO_RETURN, others=(1, 3)),
    Needed("COM_ACT_FAIL_ACT", 0, _NO_RETURN, others=(1, 2), optional=True),
    Needed("COM_IMB_PROP_ACT", 0, _NO_RETURN, others=(-1, 2), optional=True),
    Needed("MPC_Z_V_AUTO_UP", 1.0, _CLIMBS_ON, REAL32, (0.8, 1.2), flown=(0.5, 8.0), optional=True),
    Needed("MPC_LAND_CRWL", 0.6, "the last metre of a landing, on which it may have no position", REAL32, (0.3, 1.0)),
    Needed("COM_DISARM_LAND", 2.0, "motors off after touch-down", REAL32, accepted=(0.1, 4.0)),
)
_ARDUPILOT = (
    # Read first: until then nobody knows whether a pilot counts.
    Needed(LOSS, 0, f"without a transmitter it would forbid arming; {_NO_RETURN}", others=(3,)),
    Needed("VISO_TYPE", 1, "position from outside, by MAVLink"),
    Needed("VISO_SCALE", 1, "it multiplies our positions", REAL32, optional=True),
    Needed("VISO_DELAY_MS", 0, "poses are sent as predicted to now", accepted=(0, 50), optional=True),
    *_offsets("VISO_POS"),
    Needed("GPS1_TYPE", 0, "no GPS indoors", aliases=("GPS_TYPE",)),
    Needed("EK3_SRC1_POSXY", 6, "position comes from outside"),
    Needed("EK3_SRC1_VELXY", 6, "as flown; no velocity is fed"),
    Needed("EK3_SRC1_POSZ", 6, "height comes from outside"),
    Needed("EK3_SRC1_VELZ", 6, "as flown; no velocity is fed"),
    Needed("EK3_SRC1_YAW", 6, "heading comes from outside"),
    Needed("COMPASS_USE", 0, "no compass near steel"),
    Needed("COMPASS_USE2", 0, "no compass near steel"),
    Needed("COMPASS_USE3", 0, "no compass near steel"),
    Needed(
        "ARMING_CHECK",
        1048574,
        "every check by its own bit; without a GPS those of the GPS check nothing",
        successor=Needed("ARMING_SKIPCHK", 0, "no check is skipped; without a GPS those of the GPS check nothing"),
    ),
    Needed("GUID_TIMEOUT", 0.5, "time without setpoints before it stops", REAL32, accepted=(0.1, 0.5)),
    Needed("FS_GCS_ENABLE", 5, "ground station lost: land"),
    Needed("FS_GCS_TIMEOUT", 2.0, "time without our heartbeat before that", REAL32, (2.0, 3.0), flown=(2.0, 5.0)),
    Needed(
        "LAND_SPEED",
        70,
        _IN_TIME,
        INT32,
        (60, 100),
        flown=(30, 100),
        successor=Needed("LAND_SPD_MS", 0.7, _IN_TIME, REAL32, (0.6, 1.0), flown=(0.3, 1.0)),
    ),
    Needed("FS_EKF_ACTION", 1, "position lost: land"),
    Needed(
        "FS_EKF_THRESH", 0.8, "with 0 it does not land then, with more than 1 late", REAL32, (0.6, 1), optional=True
    ),
    # WIRE (ArduCopter 4.7, RC_Channel.cpp): bit 1 ignores RC_CHANNELS_OVERRIDE and MANUAL_CONTROL; 32 from the factory.
    Needed("RC_OPTIONS", 34, "the sticks of another ground station would fly it, and count as a pilot's", bits=2),
    Needed("BATT_FS_LOW_ACT", 1, _NO_RETURN, others=(0, 7), optional=True),
    Needed("BATT_FS_CRT_ACT", 1, _NO_RETURN, others=(0, 7), optional=True),
)


def needed(
    flavour: Flavour, our_system: int, overrides: Mapping[str, float] | None = None, receives: bool = False
) -> tuple[Needed, ...]:
    """Return the parameters needed by a vehicle of a flavour, for this ground station's system id.

    overrides: values of the field file, by name or alias; a name of its own is checked as well. receives: it has a
    transmitter's receiver, so that it must, and can, react to the loss of the transmitter.
    """
    wanted: tuple[Needed, ...] = _PX4
    if flavour is Flavour.ARDUPILOT:
        # WIRE (docs/reference/mavlink.md 1): only heartbeats from it keep the ground-station failsafe quiet.
        reason = "the ground station whose heartbeat counts"
        rows = (_RECEIVES if receives and row.name == LOSS else row for row in _ARDUPILOT)
        wanted = (*rows, Needed("SYSID_MYGCS", our_system, reason, aliases=("MAV_GCS_SYSID",)))
    return _overridden(wanted, overrides or {})


def _overridden(wanted: Iterable[Needed], overrides: Mapping[str, float]) -> tuple[Needed, ...]:
    left, found = dict(overrides), []
    for need in wanted:
        name = next((n for n in need.names if n in left), None)
        if name is not None:
            value, reason = left.pop(name), "as the field file says"
            need = replace(need.under(name), value=value, reason=reason, accepted=None, others=(), flown=None)
            need = replace(need, bits=0, successor=None)
        found.append(need)
    for name, value in left.items():
        kind = INT32 if value == round(value) else REAL32
        found.append(Needed(name, value, "as the field file says", kind))
    return tuple(found)


def overridden(flavour: Flavour, overrides: Mapping[str, float]) -> str:
    """Return the warning for parameters that the field file sets against the needs of indoor flight, or ""."""
    usual = {name: need.under(name) for need in needed(flavour, 0) for name in need.names}
    bold = [
        f"{n} {v:.7g} instead of {usual[n].wish}" for n, v in overrides.items() if n in usual and not usual[n].takes(v)
    ]
    return f"parameters as the field file says: {', '.join(bold)}" if bold else ""


def version_of(flight_sw_version: int) -> Version:
    """Return major and minor of the version in AUTOPILOT_VERSION."""
    return flight_sw_version >> 24 & 255, flight_sw_version >> 16 & 255


def is_checked(flavour: Flavour, version: Version | None) -> bool:
    """Return whether the tables here were compared with a release."""
    first, last = _CHECKED[flavour]
    return version is not None and first <= version <= last


def difference(wanted: Needed, found: Mapping[str, float]) -> str:
    """Return the difference of one parameter in words, or ""; found: by name or alias."""
    name = next((n for n in wanted.names if n in found), None)
    if name is None:
        return f"{wanted.name} is missing, needs {wanted.wish} ({wanted.reason})"
    need = wanted.under(name)
    return "" if need.takes(found[name]) else f"{name} is {found[name]:.7g}, needs {need.wish} ({need.reason})"


def fault(wanted: Needed, found: Mapping[str, float]) -> str:
    """Return the difference of a parameter that was found, if it forbids a take-off, or ""."""
    name = next(name for name in wanted.names if name in found)
    return difference(wanted, found) if wanted.under(name).forbids(found[name]) else ""

"""Numbers of the protocol that this project uses, by name."""

from enum import IntEnum, IntFlag

# SET_POSITION_TARGET_LOCAL_NED.type_mask: obey velocity and yaw rate, ignore all else (docs/reference/mavlink.md 5.1).
VELOCITY_AND_YAW_RATE = 0x5C7
ARMED = 128
CUSTOM_MODE_ENABLED = 1
FORCE = 21196.0
GCS_TYPE, NO_AUTOPILOT, ACTIVE = 6, 8, 4  # MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID, MAV_STATE_ACTIVE
AUTOPILOT_COMPONENT = 1
QUADROTOR = 2
ESTIMATOR_VISION = 2


class MavSeverity(IntEnum):
    """MAV_SEVERITY: 0 emergency .. 7 debug; limits of what the operator reads as an error and a warning."""

    ERROR = 3
    WARNING = 4
    INFO = 6


class Flavour(IntEnum):
    """MAV_AUTOPILOT of the two supported autopilots."""

    ARDUPILOT = 3
    PX4 = 12


class MavFrame(IntEnum):
    """MAV_FRAME."""

    LOCAL_NED = 1
    BODY_NED = 8
    BODY_FRD = 12


class MavCmd(IntEnum):
    """MAV_CMD."""

    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    CONDITION_YAW = 115
    DO_SET_MODE = 176
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_FLIGHTTERMINATION = 185
    DO_REPOSITION = 192
    DO_PAUSE_CONTINUE = 193
    COMPONENT_ARM_DISARM = 400
    GET_HOME_POSITION = 410
    SET_MESSAGE_INTERVAL = 511
    REQUEST_MESSAGE = 512
    REQUEST_PROTOCOL_VERSION = 519
    REQUEST_AUTOPILOT_CAPABILITIES = 520


class MavResult(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5


class MavState(IntEnum):
    """MAV_STATE: on the floor, in the air, in a failsafe or an emergency, and the ends of a flight; 8 is the last."""

    UNINIT = 0
    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5
    EMERGENCY = 6
    POWEROFF = 7
    FLIGHT_TERMINATION = 8


class Landed(IntEnum):
    """MAV_LANDED_STATE."""

    UNDEFINED = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKE_OFF = 3
    LANDING = 4


class ChargeState(IntEnum):
    """MAV_BATTERY_CHARGE_STATE: those below OK."""

    LOW = 2
    CRITICAL = 3
    EMERGENCY = 4
    FAILED = 5


class SensorBits(IntFlag):
    """MAV_SYS_STATUS_SENSOR."""

    GYRO = 0x1
    ACCELEROMETER = 0x2
    MAGNETOMETER = 0x4
    GPS = 0x20
    VISION_POSITION = 0x80
    RC_RECEIVER = 0x10000
    GEOFENCE = 0x100000
    PREARM_CHECK = 0x10000000


class EkfFlag(IntFlag):
    """ESTIMATOR_STATUS_FLAGS."""

    ATTITUDE = 1
    VELOCITY_HORIZ = 2
    VELOCITY_VERT = 4
    POS_HORIZ_REL = 8
    POS_HORIZ_ABS = 16
    POS_VERT_ABS = 32
    CONST_POS_MODE = 128
    PRED_POS_HORIZ_REL = 256
    PRED_POS_HORIZ_ABS = 512


# Either means a position; the second of them needs an origin as well.
ESTIMATOR_LOCATED = EkfFlag.POS_HORIZ_REL | EkfFlag.POS_HORIZ_ABS


class Px4Main(IntEnum):
    """PX4 main modes; custom_mode = main << 16 | sub << 24."""

    MANUAL = 1
    ALTITUDE = 2
    POSITION = 3
    AUTO = 4
    ACRO = 5
    OFFBOARD = 6
    STABILIZED = 7


class Px4Auto(IntEnum):
    """Sub-modes of AUTO."""

    TAKE_OFF = 2
    HOLD = 3
    MISSION = 4
    RETURN = 5
    LAND = 6
    FOLLOW = 8
    PRECISION_LAND = 9


class CopterMode(IntEnum):
    """ArduCopter's custom_mode."""

    STABILIZE = 0
    ACRO = 1
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    LOITER = 5
    RTL = 6
    CIRCLE = 7
    LAND = 9
    DRIFT = 11
    SPORT = 13
    FLIP = 14
    AUTOTUNE = 15
    POSHOLD = 16
    BRAKE = 17
    THROW = 18
    AVOID_ADSB = 19
    GUIDED_NOGPS = 20
    SMART_RTL = 21
    FLOWHOLD = 22
    FOLLOW = 23
    ZIGZAG = 24
    SYSTEMID = 25
    AUTOROTATE = 26
    AUTO_RTL = 27
    TURTLE = 28


def px4_mode(main: int, sub: int = 0) -> int:
    """Return PX4's custom_mode."""
    return main << 16 | sub << 24


def guided_mode(flavour: Flavour) -> int:
    """Return the custom_mode in which setpoints are obeyed."""
    return px4_mode(Px4Main.OFFBOARD) if flavour is Flavour.PX4 else CopterMode.GUIDED


def land_mode(flavour: Flavour) -> int:
    """Return the custom_mode in which it lands by itself."""
    return px4_mode(Px4Main.AUTO, Px4Auto.LAND) if flavour is Flavour.PX4 else CopterMode.LAND


_HOMEWARD = {
    Flavour.PX4: frozenset((px4_mode(Px4Main.AUTO, Px4Auto.RETURN),)),
    Flavour.ARDUPILOT: frozenset((CopterMode.RTL, CopterMode.SMART_RTL, CopterMode.AUTO_RTL)),
}


def flies_home(flavour: Flavour, custom_mode: int) -> bool:
    """Return whether it flies to its home by itself in a mode."""
    return custom_mode in _HOMEWARD[flavour]


# WIRE (PX4 1.16): in flight as well it climbs to MIS_TAKEOFF_ALT, 2.5 m, or to 10 m to look for a landing target.
_UPWARD = frozenset(px4_mode(Px4Main.AUTO, sub) for sub in (Px4Auto.TAKE_OFF, Px4Auto.PRECISION_LAND))


def climbs_first(flavour: Flavour, custom_mode: int) -> bool:
    """Return whether a flying vehicle begins a mode with a climb of its own, a return home aside."""
    return flavour is Flavour.PX4 and custom_mode in _UPWARD


_STICKS = {
    Flavour.PX4: frozenset(
        px4_mode(main) for main in (Px4Main.MANUAL, Px4Main.ALTITUDE, Px4Main.ACRO, Px4Main.STABILIZED)
    ),
    Flavour.ARDUPILOT: frozenset((CopterMode.STABILIZE, CopterMode.ACRO, CopterMode.ALT_HOLD)),
}


def flies_by_sticks(flavour: Flavour, custom_mode: int) -> bool:
    """Return whether a pilot's sticks alone fly it in a mode, without a position."""
    return custom_mode in _STICKS[flavour]


_SLOW = 2  # sub-mode of POSITION
_MOVED = {
    Flavour.PX4: _STICKS[Flavour.PX4] | {px4_mode(Px4Main.POSITION), px4_mode(Px4Main.POSITION, _SLOW)},
    Flavour.ARDUPILOT: _STICKS[Flavour.ARDUPILOT]
    | {CopterMode.LOITER, CopterMode.DRIFT, CopterMode.SPORT, CopterMode.POSHOLD, CopterMode.FLOWHOLD},
}


def is_moved_by_sticks(flavour: Flavour, custom_mode: int) -> bool:
    """Return whether only a pilot's sticks move it in a mode, by themselves or through its position."""
    return custom_mode in _MOVED[flavour]


def mode_name(flavour: Flavour, custom_mode: int) -> str:
    """Return a mode in words."""
    try:
        if flavour is Flavour.ARDUPILOT:
            return CopterMode(custom_mode).name
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24
        name = Px4Main(main).name
        return f"AUTO.{Px4Auto(sub).name}" if main == Px4Main.AUTO else name
    except ValueError:
        return f"mode {custom_mode:#x}"

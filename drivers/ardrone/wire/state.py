"""The navdata state word and the control state of the DEMO option."""

from enum import IntEnum

# Bits that are set in every healthy drone: PIC version and the four threads.
HEALTHY = 0x0F800000


class StateBit(IntEnum):
    """Masks of the 32-bit state word; test with `word & StateBit.FLY`."""

    FLY = 1 << 0
    VIDEO = 1 << 1
    VISION = 1 << 2
    CONTROL = 1 << 3
    ALTITUDE = 1 << 4
    USER_FEEDBACK_START = 1 << 5
    COMMAND = 1 << 6
    CAMERA = 1 << 7
    TRAVELLING = 1 << 8
    USB = 1 << 9
    NAVDATA_DEMO = 1 << 10
    NAVDATA_BOOTSTRAP = 1 << 11
    MOTORS = 1 << 12
    COM_LOST = 1 << 13
    SOFTWARE_FAULT = 1 << 14
    VBAT_LOW = 1 << 15
    USER_EL = 1 << 16
    TIMER_ELAPSED = 1 << 17
    MAGNETO_NEEDS_CALIB = 1 << 18
    ANGLES_OUT_OF_RANGE = 1 << 19
    WIND = 1 << 20
    ULTRASOUND = 1 << 21
    CUTOUT = 1 << 22
    PIC_VERSION = 1 << 23
    ATCODEC_THREAD = 1 << 24
    NAVDATA_THREAD = 1 << 25
    VIDEO_THREAD = 1 << 26
    ACQ_THREAD = 1 << 27
    CTRL_WATCHDOG = 1 << 28
    ADC_WATCHDOG = 1 << 29
    COM_WATCHDOG = 1 << 30
    EMERGENCY = 1 << 31


class ControlState(IntEnum):
    """Flight phase: the upper 16 bits of DEMO's control state."""

    DEFAULT = 0
    INIT = 1
    LANDED = 2
    FLYING = 3
    HOVERING = 4
    TEST = 5
    TRANS_TAKEOFF = 6
    TRANS_GOTOFIX = 7
    TRANS_LANDING = 8
    TRANS_LOOPING = 9


# WIRE: some minor states (SDK control_states.h, docs/reference/ardrone.md 4.2).
TAKE_OFF_AUTO = 1
FLYING_COMBINED_YAW = 4
FLYING_NO_VISION = 6
HOVERING_LOST_COM = 8
HOVERING_MAGNETO_CALIB = 12


def bit_names(word: int) -> tuple[str, ...]:
    """Return the names of the bits that are set, lowest first."""
    return tuple(bit.name for bit in StateBit if word & bit)


def split_control_state(control_state: int) -> tuple[ControlState, int]:
    """Return (phase, minor state); an unknown phase is DEFAULT."""
    major = control_state >> 16
    return (
        ControlState(major) if major <= ControlState.TRANS_LOOPING else ControlState.DEFAULT
    ), control_state & 0xFFFF


def join_control_state(phase: ControlState, minor: int = 0) -> int:
    """Return the 32-bit control state of a phase and its minor state."""
    return phase << 16 | minor & 0xFFFF

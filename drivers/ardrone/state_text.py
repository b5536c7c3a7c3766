"""The state word in words, with remedies for the operator. Pure."""

from drivers.ardrone.wire.state import StateBit

_WORDS: dict[StateBit, str] = {
    StateBit.FLY: "flying",
    StateBit.VIDEO: "video enabled",
    StateBit.VISION: "vision enabled",
    StateBit.CONTROL: "controls angular speed",
    StateBit.ALTITUDE: "holds its altitude",
    StateBit.USER_FEEDBACK_START: "start button pressed",
    StateBit.COMMAND: "waits for an acknowledgement",
    StateBit.CAMERA: "camera ready",
    StateBit.TRAVELLING: "travelling mode",
    StateBit.USB: "USB stick found",
    StateBit.NAVDATA_DEMO: "demo navdata",
    StateBit.NAVDATA_BOOTSTRAP: "waits for the choice of navdata",
    StateBit.MOTORS: "MOTOR PROBLEM",
    StateBit.COM_LOST: "COMMUNICATION LOST",
    StateBit.SOFTWARE_FAULT: "SOFTWARE FAULT",
    StateBit.VBAT_LOW: "BATTERY TOO LOW",
    StateBit.USER_EL: "EMERGENCY BY THE USER",
    StateBit.TIMER_ELAPSED: "timer elapsed",
    StateBit.MAGNETO_NEEDS_CALIB: "magnetometer needs calibration",
    StateBit.ANGLES_OUT_OF_RANGE: "TILTED TOO FAR",
    StateBit.WIND: "TOO MUCH WIND",
    StateBit.ULTRASOUND: "ULTRASOUND DEAF",
    StateBit.CUTOUT: "MOTOR CUT OUT",
    StateBit.PIC_VERSION: "motor firmware right",
    StateBit.ATCODEC_THREAD: "commands run",
    StateBit.NAVDATA_THREAD: "navdata run",
    StateBit.VIDEO_THREAD: "video runs",
    StateBit.ACQ_THREAD: "sensors run",
    StateBit.CTRL_WATCHDOG: "control loop late",
    StateBit.ADC_WATCHDOG: "sensor board late",
    StateBit.COM_WATCHDOG: "nobody commands it",
    StateBit.EMERGENCY: "EMERGENCY",
}

_REMEDIES: dict[StateBit, str] = {
    StateBit.EMERGENCY: "emergency: put it level on the floor; the next TAKEOFF ends it, if its cause is gone",
    StateBit.CUTOUT: "a motor was stopped: free the propellers",
    StateBit.MOTORS: "a motor does not answer: look at the propellers, gears and cables, then restart the drone",
    StateBit.SOFTWARE_FAULT: "restart the drone",
    StateBit.VBAT_LOW: "charge or change the battery",
    StateBit.ANGLES_OUT_OF_RANGE: "put it level",
    StateBit.ULTRASOUND: "the ultrasound hears nothing: clean it, and fly over a floor that reflects",
    StateBit.MAGNETO_NEEDS_CALIB: "calibrate the magnetometer if its heading matters (we only use its changes)",
}


def state_in_words(word: int) -> tuple[str, ...]:
    """Return the meaning of each set bit, lowest bit first; bits that stop a flight are in capitals."""
    return tuple(text for bit, text in _WORDS.items() if word & bit)


def state_remedies(word: int) -> tuple[str, ...]:
    """Return the remedies for the bits that are set."""
    return tuple(text for bit, text in _REMEDIES.items() if word & bit)

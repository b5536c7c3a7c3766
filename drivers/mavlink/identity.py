"""Identifies a vehicle by its firmware, and by the number that its autopilot's maker gave it. Pure."""

from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.telemetry import AutopilotVersion

_WORDS = {Flavour.PX4: "a PX4", Flavour.ARDUPILOT: "an ArduPilot"}


def other_flavour(autopilot: int, flavour: Flavour) -> str:
    """Return that a vehicle is another kind than the field file says, with the remedy; "" if it is not."""
    if autopilot == flavour:
        return ""
    words = {kind.value: text for kind, text in _WORDS.items()}
    found = words.get(autopilot, f"neither a PX4 nor an ArduPilot (autopilot {autopilot})")
    remedy = ": change mavlink.flavour" if autopilot in words else ""
    return f"it is {found}, the field says {flavour.name.lower()}{remedy}"


def serial_number_of(version: AutopilotVersion) -> str:
    """Return the number as hexadecimal digits, "" if the autopilot has none.

    WIRE (AUTOPILOT_VERSION): uid2 is the number where it is not all zero, in the order of its bytes; else uid is.
    """
    if any(version.uid2):
        return bytes(version.uid2).hex().upper()
    return f"{version.uid:016X}" if version.uid else ""

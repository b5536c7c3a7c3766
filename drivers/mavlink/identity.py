"""Identifies a vehicle by the number that its autopilot's maker gave it. Pure."""

from drivers.mavlink.wire.telemetry import AutopilotVersion


def serial_number_of(version: AutopilotVersion) -> str:
    """Return the number as hexadecimal digits, "" if the autopilot has none.

    WIRE (AUTOPILOT_VERSION): uid2 is the number where it is not all zero, in the order of its bytes; else uid is.
    """
    if any(version.uid2):
        return bytes(version.uid2).hex().upper()
    return f"{version.uid:016X}" if version.uid else ""

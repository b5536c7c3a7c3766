"""Encoding of parameters: PX4 puts the bits of an integer into the float, ArduPilot its value.

WIRE: docs/reference/mavlink.md 5.4. A PX4 takes and keeps what is no number, and tells it (1.16, 5.15).
"""

import struct

from drivers.mavlink.wire.names import Flavour

INT32, REAL32 = 6, 9
_INTEGERS = range(1, 9)  # MAV_PARAM_TYPE UINT8 .. INT64


def carried_from_value(flavour: Flavour, value: float, kind: int) -> float:
    """Return the number for param_value."""
    if flavour is Flavour.PX4 and kind in _INTEGERS:
        carried: float = struct.unpack("<f", struct.pack("<i", round(value)))[0]
        return carried
    return float(value)


def value_from_carried(flavour: Flavour, carried: float, kind: int) -> float:
    """Return the value in a param_value, which may be no number."""
    if flavour is Flavour.PX4 and kind in _INTEGERS:
        return float(struct.unpack("<i", struct.pack("<f", carried))[0])
    return float(carried)

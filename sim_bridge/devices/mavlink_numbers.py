"""Whole numbers in the float parameters of commands, as the firmwares' casts make them. Pure.

WIRE (PX4 and ArduPilot, source): a parameter that is no number becomes 0, on ARM as on x86.
"""

import math


def whole(value: float) -> int:
    """Return a number without its fraction, 0 for what is none."""
    return int(value) if math.isfinite(value) else 0


def nearest(value: float) -> int:
    """Return the nearest whole number, halves away from zero, 0 for what is none."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value)) if math.isfinite(value) else 0


def byte(value: float) -> int:
    """Return the lowest eight bits of a number without its fraction."""
    return whole(value) & 0xFF


def signed_byte(value: float) -> int:
    """Return the lowest eight bits of the nearest whole number, -128 to 127."""
    return (nearest(value) + 128) % 256 - 128

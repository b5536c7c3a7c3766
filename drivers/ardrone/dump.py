"""The configuration dump of the control port, compared with the written values. Pure."""

import math
from collections.abc import Iterable

from drivers.ardrone.wire.configuration import CONFIGURATION

END = b"\0"
# Numbers lose digits on their way through the drone's 32-bit floats.
_RELATIVE = 1e-3


def parse_dump(text: bytes) -> dict[str, str]:
    """Return key -> value text of a dump with or without its NUL; a line without a key continues the last.

    WIRE (docs/reference/ardrone.md 5.2): `section:key = value` lines; vectors and matrices may be wrapped over lines.
    """
    values: dict[str, str] = {}
    last = ""
    for line in text.rstrip(END).decode("latin-1").splitlines():
        name, separator, value = line.partition(" =")  # an empty value may lack the space behind it
        if separator and ":" in name and " " not in name.strip():
            last = name.strip().lower()
            values[last] = value.strip()
        elif last and line.strip():
            values[last] = f"{values[last]} {line.strip()}"
    return values


def differences(wanted: Iterable[tuple[str, str]], stored: dict[str, str]) -> tuple[tuple[tuple[str, str], str], ...]:
    """Return ((key, wanted), stored) where they differ; keys that the drone does not list are not compared."""
    return tuple(
        ((key, value), stored[key]) for key, value in wanted if key in stored and not _same(key, value, stored[key])
    )


def _same(key: str, wanted: str, stored: str) -> bool:
    known = CONFIGURATION.get(key)
    if known is None or isinstance(known.default, str | bool):
        return wanted.casefold() == stored.casefold()
    try:
        return math.isclose(float(wanted), float(stored), rel_tol=_RELATIVE, abs_tol=1e-6)
    except ValueError:
        return False


def category(key: str) -> str:
    """Return the set a key is stored in (common, applis, profiles, sessions), or "" for an unknown one."""
    known = CONFIGURATION.get(key)
    return "" if known is None else known.category.value

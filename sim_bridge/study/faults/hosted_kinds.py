"""Kinds of vehicles whose drivers can be hosted in one thread, with sockets in memory (`vehicles.py`)."""

from collections.abc import Mapping
from typing import Any

UP_AFTER_S: Mapping[str, float] = {"ardrone": 8.0, "mavlink": 14.0}
"""By when they are in the air [s]."""

WRONG_ORDER = 2
"""Exit code of a study that cannot be flown as ordered."""


def unhosted(drones: Mapping[str, Mapping[str, Any]]) -> str:
    """Return which drones of a resolved field cannot be flown here, and what can; "" if all can."""
    others = [f"{name} is of kind {drone['kind']}" for name, drone in drones.items() if drone["kind"] not in UP_AFTER_S]
    if not others:
        return ""
    return (
        f"{', '.join(others)}: flights at message level are of {', '.join(UP_AFTER_S)} only; "
        "fly the field at the wire: groundstation sitl --scenario FILE"
    )

"""Kinds of vehicles (`vehicles.py`) and of faults that can be flown in one thread, with sockets in memory."""

from collections.abc import Iterable, Mapping
from typing import Any

from sim_bridge.fault_kinds import RULES, Fault, FaultKind, Part

UP_AFTER_S: Mapping[str, float] = {"ardrone": 8.0, "mavlink": 14.0}
"""By when they are in the air [s]."""

WRONG_ORDER = 2
"""Exit code of a study that cannot be flown as ordered."""

_BROKEN_HERE = frozenset(
    kind
    for kind, rules in RULES.items()
    if rules.part in (Part.VEHICLE, Part.ABLE_VEHICLE, Part.CAMERA) and kind is not FaultKind.IDS_SWAPPED
) | {FaultKind.BODY_TURNED, FaultKind.ANCHOR_FROZEN}
_AT_THE_WIRE = "at the wire: groundstation sitl --scenario FILE"


def unhosted(drones: Mapping[str, Mapping[str, Any]]) -> str:
    """Return a sentence on the drones of a resolved field that cannot be flown here; "" if all can."""
    others = [f"{name} is of kind {drone['kind']}" for name, drone in drones.items() if drone["kind"] not in UP_AFTER_S]
    if not others:
        return ""
    return (
        f"{', '.join(others)}: flights at message level are of {', '.join(UP_AFTER_S)} only; "
        f"fly the field {_AT_THE_WIRE}"
    )


def unbroken(faults: Iterable[Fault]) -> str:
    """Return a sentence naming faults that would have no effect here; "" if all have one."""
    idle = [fault for fault in faults if fault.kind not in _BROKEN_HERE]
    if idle:
        named = ", ".join(f"{fault.kind} of {fault.entity}" for fault in idle)
        return f"{named}: nothing breaks so at message level; fly it {_AT_THE_WIRE}"
    return ""

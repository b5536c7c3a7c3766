"""Drones that took part in a flight although no report of their own says so: nobody knows what they did."""

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import AIRBORNE, UNHEARD, AckStage, Verb
from groundstation.report.tracks import RunData

_OBEYED, _FLIES = (AckStage.ACCEPTED, AckStage.EFFECTIVE), (Verb.TAKEOFF, Verb.TRACK)
# Reports come five times a second; a plan may move a drone for a moment longer than it flies.
_LAG_S = 1.0


def unreported(data: RunData) -> list[str]:
    """Return the drones that a plan moved, or that obeyed an order to fly, while their reports are not recorded.

    A drone that only stood there took no part, whether its driver was heard or not.
    """
    return [name for name in data.drones if _lacks_reports(data, name)]


def _lacks_reports(data: RunData, name: str) -> bool:
    part_s = _took_part_s(data, name)
    said = sorted((item.time_s, item.message.flight_state) for item in data.vehicles.get(name, ()))
    heard = [(at_s, state in AIRBORNE) for at_s, state in said if state not in UNHEARD]
    heard_s = np.array([-np.inf, *(at_s for at_s, _ in heard)])
    flew = np.array([False, *(flies for _, flies in heard)])
    newest = np.searchsorted(heard_s, part_s, side="right") - 1
    return bool(np.any(~flew[newest] & (part_s - heard_s[newest] > _LAG_S)))


def _took_part_s(data: RunData, name: str) -> Array:
    moved = [plan.time_s for plan in data.plans if any(one.robot == name for one in plan.message.controls)]
    obeyed = [
        ack.time_s
        for ack in data.acks
        if ack.message.header.entity == name and ack.message.verb in _FLIES and ack.message.stage in _OBEYED
    ]
    return np.array([*moved, *obeyed], dtype=np.float64)

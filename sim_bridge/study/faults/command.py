"""`python -m sim_bridge.study faults < order.json`: fly some seeds of the campaign.

Its own key: kinds of faults; an empty list: all that are drawn at random; "none": healthy flights only.
"""

from collections.abc import Sequence
from typing import Any

from sim_bridge.fault_kinds import FaultKind
from sim_bridge.study.faults.draw import ALL_KINDS, KINDS, draw
from sim_bridge.study.faults.flight_order import FlightOrder, WrongOrder
from sim_bridge.study.faults.hosted_kinds import UP_AFTER_S

# Faults begin when the team has found the target, and early enough that their consequences are seen.
_SETTLED_S, _LEFT_S = 3.0, 6.0
_HEALTHY = "none"


def fly(order: FlightOrder, seed: int) -> dict[str, Any]:
    """Return the verdict on one seed; if the order has only this one, with its events as "events".

    Raises WrongOrder for an unknown kind of fault, or one that nothing of the field can have.
    """
    from sim_bridge.study.faults.flight import FaultFlight

    kinds = _kinds(order.own.get("kinds") or ())
    up_s = max(UP_AFTER_S[drone["kind"]] for drone in order.field["drones"].values())
    window_s = (up_s + _SETTLED_S, up_s + order.seconds - _LEFT_S)
    flight = FaultFlight(draw(order.field, order.scenario, seed, window_s, kinds), order.sections, order.seconds)
    report = flight.run()
    if len(order.seeds) == 1:
        report["events"] = [f"{at_s:6.2f} s  {line}" for at_s, line in flight.events]
    return report


def _kinds(wanted: Sequence[str]) -> tuple[FaultKind, ...]:
    known = [*map(str, ALL_KINDS), _HEALTHY]
    if _HEALTHY in wanted and len(wanted) > 1:
        raise WrongOrder(f"{_HEALTHY} flies healthy flights only: name it alone")
    if unknown := [kind for kind in wanted if kind not in known]:
        raise WrongOrder(f"no kind of fault: {', '.join(unknown)}; there are {', '.join(known)}")
    return tuple(FaultKind(kind) for kind in wanted or KINDS if kind != _HEALTHY)

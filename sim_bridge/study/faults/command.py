"""`python -m sim_bridge.study faults < order.json`: fly some seeds of the campaign; a JSON line for each.

The order: field (resolved), sections of its drivers as [kind, section], scenario, seeds, seconds, kinds (an empty list:
all that are drawn; "none": healthy flights only).
"""

import json
import sys
from typing import Any

from groundstation.process import numba_cache
from sim_bridge.fault_kinds import FaultKind
from sim_bridge.scenario import parse_scenario
from sim_bridge.study.faults.draw import KINDS, draw
from sim_bridge.study.faults.hosted_kinds import UP_AFTER_S, WRONG_ORDER, unhosted

# Faults begin when the team has found the target, and early enough for what must follow to be seen.
_SETTLED_S, _LEFT_S = 3.0, 6.0
_HEALTHY = "none"


def fly(order: dict[str, Any], seed: int, events: bool) -> dict[str, Any]:
    """Return the verdict on one seed."""
    from sim_bridge.study.faults.flight import FaultFlight

    up_s = max(UP_AFTER_S[drone["kind"]] for drone in order["field"]["drones"].values())
    window_s = (up_s + _SETTLED_S, up_s + order["seconds"] - _LEFT_S)
    kinds = tuple(FaultKind(kind) for kind in order.get("kinds") or KINDS if kind != _HEALTHY)
    drawn = draw(order["field"], parse_scenario(json.dumps(order["scenario"])), seed, window_s, kinds)
    flight = FaultFlight(drawn, [(kind, section) for kind, section in order["sections"]], order["seconds"])
    report = flight.run()
    if events:
        report["events"] = [f"{at_s:6.2f} s  {line}" for at_s, line in flight.events]
    return report


def main() -> int:
    """Fly the seeds of the order on standard input; WRONG_ORDER for an unknown kind of fault or of vehicle."""
    order = json.load(sys.stdin)
    known, wanted = [*map(str, KINDS), _HEALTHY], order.get("kinds") or []
    if _HEALTHY in wanted and len(wanted) > 1:
        print(f"{_HEALTHY} flies healthy flights only: name it alone", file=sys.stderr)
        return WRONG_ORDER
    if unknown := [kind for kind in wanted if kind not in known]:
        print(f"no kind of fault: {', '.join(unknown)}; there are {', '.join(known)}", file=sys.stderr)
        return WRONG_ORDER
    if refusal := unhosted(order["field"]["drones"]):
        print(refusal, file=sys.stderr)
        return WRONG_ORDER
    numba_cache.activate()
    for seed in order["seeds"]:
        print(json.dumps(fly(order, seed, len(order["seeds"]) == 1)), flush=True)
    return 0

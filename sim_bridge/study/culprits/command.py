"""`python -m sim_bridge.study culprits < order.json`: fly some seeds with wrong figures; a JSON line for each.

The order: field (resolved, as the ground station is told), sections of its drivers as [kind, section], scenario, seeds,
seconds, errors as [who, part, true minus told], exchanged as [drone, whose marker it carries], stand_s: seconds on the
pads.
"""

import json
import sys

from groundstation.process import numba_cache
from sim_bridge.scenario import parse_scenario
from sim_bridge.study.faults.hosted_kinds import WRONG_ORDER, unhosted
from sim_bridge.study.wrong_figures import WrongFigures


def main() -> int:
    """Fly the seeds of the order on standard input; WRONG_ORDER for an unknown kind of vehicle."""
    order = json.load(sys.stdin)
    numba_cache.activate()
    from sim_bridge.study.culprits.flight import CulpritFlight
    from sim_bridge.study.scenarios.flight import as_drawn

    if refusal := unhosted(order["field"]["drones"]):
        print(refusal, file=sys.stderr)
        return WRONG_ORDER
    scenario = parse_scenario(json.dumps(order["scenario"]))
    sections = [(kind, section) for kind, section in order["sections"]]
    wrong = WrongFigures({(who, part): size for who, part, size in order["errors"]}, dict(order["exchanged"]))
    for seed in order["seeds"]:
        drawn = as_drawn(order["field"], scenario, seed)
        flight = CulpritFlight(drawn, sections, order["seconds"], wrong, order["stand_s"])
        print(json.dumps(flight.fly()), flush=True)
    return 0

"""`python -m sim_bridge.study missions < order.json`: fly some seeds; a JSON line for each.

The order: field (resolved), sections of its drivers as [kind, section], scenario, seeds, seconds, understated (by how
much the covariance of sightings is too small in every third flight).
"""

import json
import sys

from groundstation.process import numba_cache
from sim_bridge.scenario import parse_scenario
from sim_bridge.study.faults.hosted_kinds import WRONG_ORDER, unhosted

_EVERY = 3


def main() -> int:
    """Fly the seeds of the order on standard input; WRONG_ORDER for an unknown kind of vehicle."""
    order = json.load(sys.stdin)
    if refusal := unhosted(order["field"]["drones"]):
        print(refusal, file=sys.stderr)
        return WRONG_ORDER
    numba_cache.activate()
    from sim_bridge.study.missions.draw import draw_mission
    from sim_bridge.study.missions.flight import MissionFlight

    scenario = parse_scenario(json.dumps(order["scenario"]))
    sections = [(kind, section) for kind, section in order["sections"]]
    for seed in order["seeds"]:
        share = 1.0 / order["understated"] if seed % _EVERY == 0 else 1.0
        drawn = draw_mission(order["field"], scenario, seed)
        print(json.dumps(MissionFlight(drawn, sections, order["seconds"], share).fly()), flush=True)
    return 0

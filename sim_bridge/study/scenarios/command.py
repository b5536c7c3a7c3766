"""`python -m sim_bridge.study scenarios < order.json`: fly some seeds of a scenario; a JSON line for each.

The order: field (resolved), sections of its drivers as [kind, section], scenario, seeds, seconds, strategy.
"""

import json
import sys

from groundstation.process import numba_cache
from sim_bridge.scenario import parse_scenario
from sim_bridge.study.faults.hosted_kinds import WRONG_ORDER, unhosted


def main() -> int:
    """Fly the seeds of the order on standard input; WRONG_ORDER for an unknown strategy or kind of vehicle."""
    order = json.load(sys.stdin)
    numba_cache.activate()
    from sim_bridge.study.scenarios.flight import ScenarioFlight, as_drawn
    from sim_bridge.study.scenarios.strategies import STRATEGIES

    if order["strategy"] not in STRATEGIES:
        print(f"no strategy {order['strategy']!r}; there are {', '.join(STRATEGIES)}", file=sys.stderr)
        return WRONG_ORDER
    if refusal := unhosted(order["field"]["drones"]):
        print(refusal, file=sys.stderr)
        return WRONG_ORDER
    scenario = parse_scenario(json.dumps(order["scenario"]))
    sections = [(kind, section) for kind, section in order["sections"]]
    for seed in order["seeds"]:
        drawn = as_drawn(order["field"], scenario, seed)
        print(json.dumps(ScenarioFlight(drawn, sections, order["seconds"], order["strategy"]).fly()), flush=True)
    return 0

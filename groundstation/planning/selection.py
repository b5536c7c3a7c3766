"""Which of the optimised topologies is flown: the cheapest, unless it gains too little or comes too soon."""

from collections.abc import Mapping

from groundstation.sensing.topology import Topology


def choose(current: Topology, costs: Mapping[Topology, float], required_gain: float) -> Topology:
    """Return the cheapest topology if it beats the current one by the required relative gain, else the current one.

    Ties go to the first in the order of `costs`. PAPER: departs; the paper takes the cheapest always (gain 0).
    """
    best = min(costs, key=lambda topology: costs[topology])
    if current not in costs or costs[best] < (1.0 - required_gain) * costs[current]:
        return best
    return current

"""Strategies of a study of scenarios: our planner, fixed topologies, rules, and other methods."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from groundstation.planning.planner import Planner
from sim_bridge.study.scenarios.first_program import FirstProgram
from sim_bridge.study.scenarios.fixed_topologies import FixedPlanner, without_topology
from sim_bridge.study.scenarios.rules import RulePlanner
from sim_bridge.study.scenarios.samplers import LatticePlanner, SamplingPlanner


@dataclass(frozen=True, slots=True)
class Strategy:
    """A strategy: the planner to use in place of ours.

    edges_only: sightings along the topology's edges alone are fused, as the method's first program did; all other
    strategies differ from ours in the planner only.
    """

    planner_of: Callable[[Planner], Planner]
    edges_only: bool = False


STRATEGIES: Mapping[str, Strategy] = {
    "ours": Strategy(lambda planner: planner),
    "string": Strategy(lambda planner: FixedPlanner(planner, "string")),
    "reversed": Strategy(lambda planner: FixedPlanner(planner, "reversed")),
    "flat": Strategy(lambda planner: FixedPlanner(planner, "flat")),
    "two-level": Strategy(lambda planner: FixedPlanner(planner, "two-level")),
    "no-topology": Strategy(without_topology),
    "relay": Strategy(lambda planner: RulePlanner(planner, relay=True)),
    "chase": Strategy(lambda planner: RulePlanner(planner, relay=False)),
    "sampling": Strategy(SamplingPlanner),
    "lattice": Strategy(LatticePlanner),
    "first-program": Strategy(FirstProgram, edges_only=True),
}

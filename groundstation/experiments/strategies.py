"""Strategies of the team: the paper's search, ours, and fixed or random topologies for comparison."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from groundstation.arrays import Array, IntArray
from groundstation.experiments.filter import PlanarBelief
from groundstation.experiments.planar.parameters import PlanarParameters
from groundstation.experiments.planar.planner import PlanarPlanner, SearchMode, SearchOptions
from groundstation.experiments.planar.scenarios import layout_levels

STRATEGIES = ("paper", "certified", "global", "fixed-string", "fixed-flat", "fixed-two-level", "random")


class TeamDecision(NamedTuple):
    """Levels (n) and velocities (n, 2) [m/s] to hold until the next decision, their cost [m^2] and solver figures."""

    level: IntArray
    velocity_m_s: Array
    cost: float
    evaluations: int


class Strategy:
    """Decides once per step; keeps the current topology and the planner's warm start."""

    def __init__(
        self,
        name: str,
        robots: int,
        parameters: PlanarParameters,
        generator: np.random.Generator,
        start: str = "string",
        hysteresis: float = 0.02,
    ) -> None:
        """Raises ValueError for a name that is not in STRATEGIES."""
        if name not in STRATEGIES:
            raise ValueError(f"unknown strategy {name!r}: choose one of {', '.join(STRATEGIES)}")
        self.name = name
        self.level = layout_levels(
            name.removeprefix("fixed-") if name.startswith("fixed-") else start, robots, generator
        )
        self._generator = generator
        mode = SearchMode(name) if name in ("paper", "certified", "global") else SearchMode.CERTIFIED
        fixed = name.startswith("fixed-") or name == "random"
        options = SearchOptions(mode=mode, hysteresis=0.0 if mode is SearchMode.PAPER else hysteresis)
        self._planner = PlanarPlanner(robots, parameters, replace(options, mode=SearchMode.FIXED) if fixed else options)

    def decide(self, belief: PlanarBelief) -> TeamDecision:
        """Return the decision for this belief."""
        if self.name == "random":
            self.level = layout_levels("random", belief.robots, self._generator)
        plan = self._planner.plan(belief.positions, belief.position_covariance, self.level, belief.target_velocity)
        self.level = plan.level
        return TeamDecision(plan.level, plan.velocity_m_s[0], plan.cost, plan.evaluations)

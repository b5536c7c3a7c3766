"""How the team decides: the paper's search, ours, and fixed or random topologies to compare with."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.experiments.filter import PlanarBelief
from groundstation.planning.planar.parameters import PlanarParameters
from groundstation.planning.planar.planner import Mode, PlanarPlanner, SearchOptions
from groundstation.planning.planar.scenarios import layout_levels

Array = NDArray[np.float64]
Levels = NDArray[np.int64]

STRATEGIES = ("paper", "certified", "global", "fixed-string", "fixed-flat", "fixed-two-level", "random")


class Decision(NamedTuple):
    """Levels (n) and velocities (n, 2) [m/s] to hold until the next decision, their cost [m^2] and solver figures."""

    level: Levels
    velocity_m_s: Array
    cost: float
    evaluations: int
    considered: int


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
        mode = Mode(name) if name in ("paper", "certified", "global") else Mode.CERTIFIED
        fixed = name.startswith("fixed-") or name == "random"
        options = SearchOptions(mode=mode, hysteresis=0.0 if mode is Mode.PAPER else hysteresis)
        self._planner = PlanarPlanner(robots, parameters, replace(options, mode=Mode.FIXED) if fixed else options)

    def decide(self, belief: PlanarBelief) -> Decision:
        """Return what to do for this belief."""
        if self.name == "random":
            self.level = layout_levels("random", belief.robots, self._generator)
        plan = self._planner.plan(belief.positions, belief.position_covariance, self.level, belief.target_velocity)
        self.level = plan.level
        return Decision(plan.level, plan.velocity_m_s[0], plan.cost, plan.evaluations, len(plan.certificate))

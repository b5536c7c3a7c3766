"""Planners for comparison that optimise the motion of one topology and never change it."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.belief import JointBelief
from groundstation.planning.parameters import PlannerParameters
from groundstation.planning.planner import Planner, PlanResult
from groundstation.planning.problem import PlanningScene, ProblemBuilder
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.topology import Topology


class FixedPlanner(Planner):
    """Optimises the motion of one topology of the flying robots only: flat, string (also reversed), or two levels."""

    def __init__(
        self,
        planner: Planner,
        shape: str,
        builder_of: Callable[[PlannerParameters, SensorSuite], ProblemBuilder] = ProblemBuilder,
    ) -> None:
        super().__init__(planner.parameters, planner.sensors, builder_of)
        self._shape = shape

    def plan(
        self,
        belief: JointBelief,
        current: Topology,
        warm_start: Mapping[str, Array] | None,
        should_stop: Callable[[], bool],
        max_evaluations: int | None = None,
        held: frozenset[str] = frozenset(),
    ) -> PlanResult:
        """Return the best plan of the topology."""
        fixed = self.fixed(sorted(current.robots))
        return super().plan(belief, fixed, warm_start, should_stop, max_evaluations, held)

    def options(self, current: Topology) -> tuple[Topology, ...]:
        """Return no other topology."""
        return ()

    def fixed(self, robots: list[str]) -> Topology:
        """Return the topology over these robots."""
        match self._shape:
            case "string":
                return Topology.string(robots)
            case "reversed":
                return Topology.string(robots[::-1])
            case "two-level" if len(robots) > 1:
                half = (len(robots) + 1) // 2
                return Topology((frozenset(robots[:half]), frozenset(robots[half:])))
            case _:
                return Topology.flat(robots)


class EveryPair(ProblemBuilder):
    """Problems without a topology: every pair of a camera and a subject counts, and attracts the camera."""

    def _edges(self, scene: PlanningScene, topology: Topology) -> tuple[Any, int]:
        edges: Any = np.array(self._pairs.rows)
        edges["wanted"] = 1
        return edges, len(edges)


def without_topology(planner: Planner) -> FixedPlanner:
    """Return a planner with one solve over all pairs of a camera and a subject; heights begin as those of a string."""
    return FixedPlanner(planner, "string", EveryPair)

"""Planners for comparison without an optimiser: the relay rule and the chase."""

import math
from collections.abc import Callable, Mapping

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import SolverReport
from groundstation.estimation.belief import JointBelief
from groundstation.geometry.angles import difference
from groundstation.geometry.stabilized_frame import stabilized_from_world
from groundstation.planning.planner import Planner, PlanResult
from groundstation.sensing.topology import Topology

Point = tuple[float, float]
# The relay rule: offset of the nearest drone from the target, and the heights of it and of the drones that see it.
STAND_OFF_M, LOW_M, HIGH_M = 0.9, 1.1, 1.8
_APART_M, _INSET_M = 1.3, 0.3
_GAIN, _TURN_GAIN, _FASTEST_M_S = 0.8, 1.5, 0.6


class RulePlanner(Planner):
    """No optimiser: the drone nearest to the target stays close to it.

    relay: on the side of the world-fixed view, while the others stay in that view and look at it. Otherwise: on its own
    side, while the others stay where they are and look at the target.
    """

    def __init__(self, planner: Planner, relay: bool) -> None:
        super().__init__(planner.parameters, planner.sensors)
        self._relay = relay

    def plan(
        self,
        belief: JointBelief,
        current: Topology,
        warm_start: Mapping[str, Array] | None,
        should_stop: Callable[[], bool],
        max_evaluations: int | None = None,
        held: frozenset[str] = frozenset(),
    ) -> PlanResult:
        """Return the plan of the rule."""
        robots = [name for name in belief.layout.robots if name in current.robots]
        if not robots or not belief.layout.targets:
            return super().plan(belief, current, warm_start, should_stop, max_evaluations, held)
        target = belief.mean_of(belief.layout.targets[0])
        places = {name: _place(belief.mean_of(name)) for name in robots}
        at = _place(target)
        near = min(robots, key=lambda name: math.dist(places[name], at))
        others = [name for name in robots if name != near]
        goals = {near: (self._stand(at, places[near]), at)}
        for rank, name in enumerate(others):
            goals[name] = (self._post(places, name, near, rank), places[near] if self._relay else at)
        controls = {
            name: _control(belief.mean_of(name), *goals[name], target[2:4] if name == near else np.zeros(2))
            for name in robots
        }
        topology = Topology((frozenset(others), frozenset((near,)))) if others else Topology.flat(robots)
        heights = {name: LOW_M if name == near else HIGH_M for name in robots}
        report = SolverReport("complete", 0, 0.0, 1, 1)
        mode = self.parameters.mode
        return PlanResult(topology, 0.0, 0.0, controls, heights, (), (), report, mode, belief.stamp_ns)

    def _stand(self, target: Point, place: Point) -> Point:
        """Return the place of the nearest drone."""
        home = self._home(target)
        side = home if self._relay and home is not None and math.dist(home, target) > STAND_OFF_M / 2 else place
        way = math.dist(side, target)
        if way < 1e-6:
            return target[0] - STAND_OFF_M, target[1]
        share = STAND_OFF_M / way
        return target[0] + share * (side[0] - target[0]), target[1] + share * (side[1] - target[1])

    def _post(self, places: Mapping[str, Point], name: str, near: str, rank: int) -> Point:
        """Return the place of another drone; several spread out by rank."""
        if not self._relay:
            return places[name]
        home = self._home(places[near])
        x, y = home if home is not None else places[name]
        away = math.atan2(places[name][1] - places[near][1], places[name][0] - places[near][0])
        if math.dist((x, y), places[near]) < _APART_M:
            return places[near][0] + _APART_M * math.cos(away), places[near][1] + _APART_M * math.sin(away)
        return x, y + _APART_M * rank

    def _home(self, place: Point) -> Point | None:
        """Return the point of a world-fixed view that is nearest to a place; None without a view."""
        views = [view.shrunk(_INSET_M) for view in self.sensors.root_views(HIGH_M)]
        points = [view.nearest(*place) for view in views]
        return min(points, key=lambda point: math.dist(point, place), default=None)


def _place(mean: Array) -> Point:
    return float(mean[0]), float(mean[1])


def _control(mean: Array, stand: Point, looked_at: Point, ahead: Array) -> Array:
    """Return velocity and yaw rate (3) [base_stabilized] towards a stand, turning to the point `looked_at`."""
    velocity = np.array([*(_GAIN * (np.array(stand) - mean[:2]) + ahead), 0.0])
    velocity *= min(1.0, _FASTEST_M_S / max(float(np.linalg.norm(velocity)), 1e-9))
    yaw = math.atan2(looked_at[1] - mean[1], looked_at[0] - mean[0])
    body = stabilized_from_world(velocity, float(mean[3]))
    return np.array([body[0], body[1], _TURN_GAIN * difference(yaw, float(mean[3]))])

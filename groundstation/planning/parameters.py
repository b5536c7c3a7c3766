"""Settings of the planner: horizon, limits, level heights, assumed noise, weights."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from groundstation.estimation.parameters import usual_acceleration_m_s2
from groundstation.field.behaviour import PlannerMode
from groundstation.field.resolved import ResolvedField
from groundstation.field.targets import Target, WeightedTarget
from groundstation.sensing.models import Rectangle

SOFT_WALL_M = 0.3
"""Width of what plans avoid, before the distance that a robot must keep."""

NO_FENCE = Rectangle((-math.inf, math.inf), (-math.inf, math.inf))


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Limits that no command to a robot exceeds."""

    max_speed_m_s: float = 0.6
    max_climb_m_s: float = 0.4
    max_yaw_rate_rad_s: float = math.radians(60)


@dataclass(frozen=True, slots=True)
class ProcessNoise:
    """White-noise densities: robots' position [m^2/s] and yaw [rad^2/s], targets' acceleration [m^2/s^3]."""

    robot_position: float = 2e-3
    robot_yaw: float = 3e-4
    target_acceleration: float = 0.09


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights beside the targets' uncertainty [m^2]: see docs/explanation/planning.md 2.

    PAPER (docs/explanation/method.md 7): the forms are ours.

    robots: share of the robots' own position uncertainty; without it a robot that does not improve the target's
    estimate drifts out of every camera's view, and a drone without a known place must land.
    """

    repulsion: float = 0.1
    fence: float = 1.0
    effort: float = 2e-4
    robots: float = 0.5


@dataclass(frozen=True, slots=True)
class PlannerParameters:
    """Settings of the planner.

    level_heights_m: row n-1 holds the heights, top first, from which the search for a topology of n levels begins;
    topologies with more levels are not considered, and heights are chosen between the lowest and the highest of all.
    hysteresis: relative gain required of a new topology; within min_dwell_s of the last switch it is urgent_gain.
    fence: drones' box in the floor plan, kept fence_margin_m away from (softly), as obstacles are by obstacle_m.
    evaluation_budget and tolerance: of one solve. Of the starts of all topologies, at most `starts` of each, the
    `solves` cheapest get first_look evaluations, and the `finals` best of those go on to the end. target_weights:
    relative weights of targets' uncertainties in the cost, 1 by default.
    """

    level_heights_m: tuple[tuple[float, ...], ...]
    horizon_steps: int = 10
    step_s: float = 0.2
    discount: float = 0.9
    hysteresis: float = 0.05
    min_dwell_s: float = 2.0
    urgent_gain: float = 0.5
    separation_m: float = 1.0
    fence: Rectangle = NO_FENCE
    fence_margin_m: float = SOFT_WALL_M
    obstacle_m: float = 0.3 + SOFT_WALL_M
    limits: Mapping[str, MotionLimits] = field(default_factory=dict)
    noise: ProcessNoise = ProcessNoise()
    weights: Weights = Weights()
    target_weights: Mapping[str, float] = field(default_factory=dict)
    mode: PlannerMode = "multistart"
    evaluation_budget: int = 60
    tolerance: float = 2e-3
    starts: int = 2
    solves: int = 8
    first_look: int = 8
    finals: int = 2

    @property
    def horizon_s(self) -> float:
        """Return the length of the horizon [s]."""
        return self.horizon_steps * self.step_s

    def limits_of(self, robot: str) -> MotionLimits:
        """Return a robot's motion limits."""
        return self.limits.get(robot, MotionLimits())

    @property
    def heights_m(self) -> tuple[float, float]:
        """Return the lowest and the highest permitted height [m]."""
        all_heights = [height for row in self.level_heights_m for height in row]
        return min(all_heights), max(all_heights)

    def level_heights(self, levels: int) -> tuple[float, ...] | None:
        """Return the initial heights for a number of levels [m], or None for more levels than permitted."""
        return self.level_heights_m[levels - 1] if 0 < levels <= len(self.level_heights_m) else None


def limits_from_field(field: ResolvedField) -> dict[str, MotionLimits]:
    """Return each drone's motion limits of a resolved field."""
    limits = {name: drone.limits for name, drone in field.drones.items()}
    return {
        name: MotionLimits(own.max_speed_m_s, own.max_climb_m_s, math.radians(own.max_yaw_rate_deg_s))
        for name, own in limits.items()
    }


def parameters_from_field(field: ResolvedField) -> PlannerParameters:
    """Return the planner's settings of a resolved field."""
    planner, fence = field.planner, field.room.fence
    return PlannerParameters(
        level_heights_m=planner.level_heights_m,
        horizon_steps=planner.horizon_steps,
        step_s=planner.step_s,
        discount=planner.discount,
        hysteresis=planner.hysteresis,
        separation_m=planner.separation_m,
        fence=Rectangle(fence.x_m, fence.y_m),
        obstacle_m=field.safety.obstacle_distance_m + SOFT_WALL_M,
        limits=limits_from_field(field),
        noise=_noise(field),
        target_weights={name: _weight(target) for name, target in field.tracked.items()},
        mode=planner.mode,
    )


def _weight(target: Target) -> float:
    return target.weight if isinstance(target, WeightedTarget) else 1.0


def _noise(field: ResolvedField) -> ProcessNoise:
    """Return densities for the worst of drones and targets; velocity errors last some 0.8 s, manoeuvres 0.5 s.

    A plan looks seconds ahead, over which pushes of 0.12 s (the filter's) add up to manoeuvres.
    """
    odometry = [drone.odometry for drone in field.drones.values()]
    briskest = max(usual_acceleration_m_s2(target) for target in field.tracked.values())
    return ProcessNoise(
        robot_position=2.0 * max(o.velocity_std_m_s for o in odometry) ** 2,
        robot_yaw=max(math.radians(o.yaw_rate_std_deg_s) for o in odometry) ** 2,
        target_acceleration=0.5 * briskest**2,
    )

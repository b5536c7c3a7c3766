"""What setpoints and safety are told once."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from groundstation.field.resolved import ResolvedField
from groundstation.planning.parameters import MotionLimits, limits_from_field

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class ControlParameters:
    """Settings of the setpoints.

    search_height_m: slot while searching or returning; column_m: horizontal distance within which nobody changes
    height, and which stands of two robots keep; return_std_m: a robot outside the world-fixed views that is known
    worse than this flies back; return_unseen_s: one that no camera has seen for so long flies back too, or earlier
    where the way back takes longer than what is left until unseen_land_after_s, less return_margin_s (to turn round,
    and to be found by a camera), but never before return_soonest_s: so long a gap between sightings is usual;
    hint_std_m: up to this uncertainty the predicted target is where the search looks; max_plan_age_s: held controls
    of an older plan are not flown any more.
    """

    search_height_m: float
    limits: Mapping[str, MotionLimits] = field(default_factory=dict)
    lost_after_s: float = 3.0
    height_gain_per_s: float = 1.2
    height_tolerance_m: float = 0.15
    column_m: float = 1.0
    side_step_m_s: float = 0.25
    return_std_m: float = 0.35
    return_unseen_s: float = 7.0
    return_soonest_s: float = 1.5
    return_margin_s: float = 2.0
    return_speed_m_s: float = 0.5
    unseen_land_after_s: float = 10.0
    search_speed_m_s: float = 0.35
    search_yaw_rate_rad_s: float = 0.5
    search_stand_off_m: float = 0.9
    hint_std_m: float = 1.5
    max_plan_age_s: float = 1.0

    def limits_of(self, robot: str) -> MotionLimits:
        """Return a robot's motion limits."""
        return self.limits.get(robot, MotionLimits())


@dataclass(frozen=True, slots=True)
class SafetyParameters:
    """Settings of the output limiter.

    fence: intervals of x, y, z [m; world]; reaction_s: lag with which a vehicle follows a velocity;
    margin_m: kept from fence and separation on top of `sigmas` standard deviations of the belief.
    """

    fence: tuple[Interval, Interval, Interval]
    min_separation_m: float = 0.6
    max_position_std_m: float = 0.6
    max_belief_age_s: float = 0.3
    reaction_s: float = 0.5
    margin_m: float = 0.15
    sigmas: float = 2.0
    limits: Mapping[str, MotionLimits] = field(default_factory=dict)

    def limits_of(self, robot: str) -> MotionLimits:
        """Return a robot's motion limits."""
        return self.limits.get(robot, MotionLimits())


def control_from_field(field: ResolvedField) -> ControlParameters:
    """Return the setpoints' settings of a resolved field."""
    planner, safety = field.planner, field.safety
    return ControlParameters(
        search_height_m=planner.level_heights_m[0][0],
        limits=limits_from_field(field),
        lost_after_s=field.estimator.lost_after_s,
        return_std_m=0.6 * safety.max_position_std_m,
        return_unseen_s=0.7 * safety.unseen_land_after_s,
        unseen_land_after_s=safety.unseen_land_after_s,
        max_plan_age_s=max(1.0, 3.0 / planner.rate_hz),
    )


def safety_from_field(field: ResolvedField) -> SafetyParameters:
    """Return the output limiter's settings of a resolved field."""
    fence, safety = field.room.fence, field.safety
    return SafetyParameters(
        fence=(fence.x_m, fence.y_m, fence.z_m),
        min_separation_m=safety.min_separation_m,
        max_position_std_m=safety.max_position_std_m,
        limits=limits_from_field(field),
    )

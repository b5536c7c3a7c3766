"""Parameters of setpoints and safety."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from groundstation.control.search_height import return_height_m, search_height_m
from groundstation.field.resolved import ResolvedField
from groundstation.planning.detours import STRAIGHT, Detours
from groundstation.planning.parameters import MotionLimits, limits_from_field, parameters_from_field
from groundstation.sensing.from_field import boxes_from_field
from groundstation.sensing.models import Box
from groundstation.vectors import Interval, Vector2
from groundstation.vehicles import kind_named

_USUAL_LIMITS = MotionLimits()
# Speeds of searching robots: slow enough for sharp and densely spaced pictures.
SEARCH_SPEED_M_S, SEARCH_YAW_RATE_RAD_S = 0.5, 0.8


@dataclass(frozen=True, slots=True)
class ControlParameters:
    """Settings of the setpoints.

    search_height_m: height while searching; return_below_m: greatest height while returning; column_m: horizontal
    distance between two robots within which neither changes height, and the least between two stands; return_std_m: a
    robot outside the world-fixed views with a larger deviation flies back; so does one whose deviation would reach
    return_limit_m before it is back in view, or that would then have been unseen for return_within_s (odometry may be
    worse than its stated error), each with return_margin_s to turn round and be found; but none before
    return_soonest_s, a usual gap between sightings;
    return_drift_m_s: largest measured drift that is subtracted on the way back; drift_m_s: least rate at which a place
    becomes uncertain out of sight, starting from seen_std_m; sound_error_m_s: largest error of sound odometry;
    regain_after_s: when a target has been unseen for this long, the robots that track it turn to it and back off;
    hint_std_m: no plan uses a target with a larger deviation; planned_s: how far plans reach; max_plan_age_s: controls
    of an older plan are no longer flown; fed: robots that fly on our estimate; untied_after_s: if no sensor locates
    them for this long, they turn back; the next sighting takes 0.3 s at most, where there is one. detours: ways round
    obstacles to stands.
    """

    search_height_m: float
    limits: Mapping[str, MotionLimits] = field(default_factory=dict)
    lost_after_s: float = 3.0
    height_gain_per_s: float = 1.2
    height_tolerance_m: float = 0.15
    column_m: float = 1.0
    side_step_m_s: float = 0.25
    return_std_m: float = 0.35
    return_limit_m: float = 0.5
    return_within_s: float = 15.0
    return_soonest_s: float = 1.5
    return_margin_s: float = 1.5
    return_speed_m_s: float = 0.5
    return_drift_m_s: float = 0.3
    drift_m_s: float = 0.03
    sound_error_m_s: float = 0.12
    seen_std_m: float = 0.05
    regain_after_s: float = 0.35
    search_speed_m_s: float = SEARCH_SPEED_M_S
    search_yaw_rate_rad_s: float = SEARCH_YAW_RATE_RAD_S
    hint_std_m: float = 1.5
    planned_s: float = 3.0
    max_plan_age_s: float = 1.0
    fed: frozenset[str] = frozenset()
    untied_after_s: float = 0.4
    return_below_m: float = math.inf
    detours: Detours = STRAIGHT

    @property
    def return_height_m(self) -> float:
        """Return the height of ways back into view."""
        return min(self.search_height_m, self.return_below_m)

    def limits_of(self, robot: str) -> MotionLimits:
        """Return a robot's motion limits."""
        return self.limits.get(robot, _USUAL_LIMITS)


@dataclass(frozen=True, slots=True)
class SafetyParameters:
    """Settings of the output limiter.

    fence: intervals of x, y, z [m; world]; reaction_s: lag with which a vehicle follows a velocity; margin_m: distance
    kept from fence and other robots beyond `sigmas` standard deviations of the belief. drift_m_s: motion beyond the
    commands that may not have been noticed yet; most_drift_m_s: largest drift that is countered; return_m_s: a robot
    beyond the fence is led back at so much more.
    max_known_velocity_error_m_s, max_velocity_error_m_s: largest mean and rms error of the odometry, by the belief,
    with which a robot may fly unseen; robots that fly on our estimate are exempt. pads: where robots take off
    [x, y; world]. obstacles: what robots keep their centres obstacle_distance_m away from.
    """

    fence: tuple[Interval, Interval, Interval]
    min_separation_m: float = 0.6
    max_position_std_m: float = 0.6
    max_known_velocity_error_m_s: float = 0.3
    max_velocity_error_m_s: float = 0.45
    max_belief_age_s: float = 0.3
    reaction_s: float = 0.5
    margin_m: float = 0.15
    sigmas: float = 2.0
    drift_m_s: float = 0.05
    most_drift_m_s: float = 0.2
    return_m_s: float = 0.15
    limits: Mapping[str, MotionLimits] = field(default_factory=dict)
    pads: Mapping[str, Vector2] = field(default_factory=dict)
    obstacles: tuple[Box, ...] = ()
    obstacle_distance_m: float = 0.3

    def limits_of(self, robot: str) -> MotionLimits:
        """Return a robot's motion limits."""
        return self.limits.get(robot, _USUAL_LIMITS)


def search_speed_m_s(field: ResolvedField) -> float:
    """Return the speed of searches and ways back: no more than the slowest drone flies."""
    return min([SEARCH_SPEED_M_S, *(drone.limits.max_speed_m_s for drone in field.drones.values())])


def control_from_field(field: ResolvedField) -> ControlParameters:
    """Return the setpoints' settings of a resolved field."""
    planner, safety, speed_m_s, height_m = field.planner, field.safety, search_speed_m_s(field), search_height_m(field)
    return ControlParameters(
        return_speed_m_s=speed_m_s,
        search_speed_m_s=speed_m_s,
        search_height_m=height_m,
        return_below_m=return_height_m(field, height_m),
        limits=limits_from_field(field),
        lost_after_s=field.estimator.lost_after_s,
        return_std_m=0.6 * safety.max_position_std_m,
        return_limit_m=0.8 * safety.max_position_std_m,
        return_within_s=0.5 * safety.unseen_land_at_last_s,
        planned_s=planner.horizon_steps * planner.step_s,
        max_plan_age_s=planner.max_plan_age_s,
        detours=_detours(field),
        fed=frozenset(n for n, drone in field.drones.items() if kind_named(drone.kind).habits.flies_on_estimate),
    )


def safety_from_field(field: ResolvedField) -> SafetyParameters:
    """Return the output limiter's settings of a resolved field."""
    fence, safety = field.room.fence, field.safety
    return SafetyParameters(
        fence=(fence.x_m, fence.y_m, fence.z_m),
        min_separation_m=safety.min_separation_m,
        max_position_std_m=safety.max_position_std_m,
        limits=limits_from_field(field),
        pads={name: drone.pad_m for name, drone in field.drones.items()},
        obstacles=boxes_from_field(field),
        obstacle_distance_m=safety.obstacle_distance_m,
    )


def _detours(field: ResolvedField) -> Detours:
    """Return ways that are as far from obstacles as plans are, and where the output limiter lets robots fly."""
    safety, planner = safety_from_field(field), parameters_from_field(field)
    return Detours(safety.obstacles, planner.obstacle_m, planner.fence, safety.margin_m, safety.sigmas)

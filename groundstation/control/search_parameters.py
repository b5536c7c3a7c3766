"""Settings of the search for unseen targets."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from groundstation.control.parameters import SEARCH_SPEED_M_S, SEARCH_YAW_RATE_RAD_S, search_speed_m_s
from groundstation.control.search_ranges import search_ranges_m
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import MotionCapture, WorldCamera
from groundstation.vectors import Interval

NEAR_YAW_RATE_RAD_S = 1.04
"""For a target that was tracked when it got out of sight: it is near, and large even in a slightly blurred picture."""


@dataclass(frozen=True, slots=True)
class SearchParameters:
    """Settings of the search for unseen targets.

    room_m: size along x and y; ranges_m: within which a search of each robot's pictures succeeds, larger than those
    that plans count on; observers: robots and world-fixed cameras that may see targets; begin_after_s: time unseen
    after which a map replaces the Gaussian; given_up_below: the search begins early, before `lost_after_s`, when the
    probability that the target is where it was predicted falls below this; patience_s: a view this much later counts
    1/e; near_yaw_rate_rad_s: yaw rate while all targets searched for were tracked before; keep_gain: another stand must
    promise this much more; starts_ahead_m: how far before the team a target that was never seen is expected;
    target_speed_m_s, target_straight_s: of a target that drives about; lost_after_s, lost_excluded: length of a search,
    and share of the floor excluded by it, of that which it can show, after which the operator is asked.
    """

    room_m: tuple[float, float]
    fence_x_m: Interval
    fence_y_m: Interval
    observers: tuple[str, ...]
    ranges_m: Mapping[str, float] = field(default_factory=dict)
    apart_m: float = 1.0
    fence_inset_m: float = 0.3
    begin_after_s: float = 0.6
    given_up_below: float = 0.3
    speed_m_s: float = SEARCH_SPEED_M_S
    yaw_rate_rad_s: float = SEARCH_YAW_RATE_RAD_S
    near_yaw_rate_rad_s: float = NEAR_YAW_RATE_RAD_S
    look_s: float = 0.4
    patience_s: float = 10.0
    keep_gain: float = 1.3
    plan_period_s: float = 0.3
    starts_ahead_m: float = 1.2
    target_speed_m_s: float = 0.3
    target_straight_s: float = 2.0
    lost_after_s: float = 45.0
    lost_excluded: float = 0.85


def search_from_field(resolved: ResolvedField) -> SearchParameters:
    """Return the settings of a resolved field."""
    room, planner = resolved.room, resolved.planner
    turn_rad_s = math.radians(min(drone.limits.max_yaw_rate_deg_s for drone in resolved.drones.values()))
    fixed: dict[str, WorldCamera | MotionCapture] = {**resolved.cameras, **resolved.sensing_capture}
    cameras = tuple(name for name, sensor in fixed.items() if "targets" in sensor.observes)
    return SearchParameters(
        room_m=(room.size_m[0], room.size_m[1]),
        fence_x_m=room.fence.x_m,
        fence_y_m=room.fence.y_m,
        speed_m_s=search_speed_m_s(resolved),
        yaw_rate_rad_s=min(SEARCH_YAW_RATE_RAD_S, turn_rad_s),
        near_yaw_rate_rad_s=min(NEAR_YAW_RATE_RAD_S, turn_rad_s),
        observers=(*resolved.drones, *cameras),
        ranges_m=search_ranges_m(resolved),
        apart_m=max(1.0, planner.separation_m),
    )

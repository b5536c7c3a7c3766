"""The last step before a setpoint is sent: shrinks a velocity or hovers.

It adds velocity only against a drift, or to lead a robot back into the fence.

Why its half-spaces keep fence and separation for any wanted velocity: docs/explanation/safety.md#why-it-holds.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from groundstation.arrays import Array
from groundstation.control.half_spaces import TOLERANCE_M_S, project
from groundstation.control.parameters import SafetyParameters
from groundstation.control.setpoints import Setpoint
from groundstation.control.shafts import Shaft
from groundstation.control.view import is_placed
from groundstation.control.walls import Wall, held_off, led_back, place_of, turning, walls_around
from groundstation.estimation.belief import JointBelief
from groundstation.geometry.stabilized_frame import stabilized_from_world, world_from_stabilized
from groundstation.planning.parameters import MotionLimits
from groundstation.vectors import Vector3, dot

# No two bodies are this near to each other: if their estimates are, the direction between them is unknown.
_NO_SIDE_M = 0.1
_NO_SHAFTS: Mapping[str, Shaft] = MappingProxyType({})
# Number of sides of a polygon within the circle of the fastest horizontal velocities.
_ROUND = np.array([(math.cos(a), math.sin(a), 0.0) for a in np.arange(16) * (2.0 * math.pi / 16)])
# A velocity that was clipped to a limit, or asked for at it, may exceed it by this much.
_ROUNDING_M_S = 1e-10
# Trials for the share of a way back: the whole of it first, at last 2 mm/s.
_TRIALS = 7
_UP_DOWN = np.array(((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)))


@dataclass(frozen=True, slots=True)
class Limited:
    """A setpoint that may be sent, the names of the limits that changed it, and the wanted velocity, if finite.

    holds: it keeps a robot, hovering by order, at its place.
    """

    setpoint: Setpoint
    limited_by: tuple[str, ...] = ()
    wanted_m_s: Vector3 | None = None
    holds: bool = False


def limit_setpoint(
    robot: str,
    setpoint: Setpoint,
    belief: JointBelief,
    now_ns: int,
    parameters: SafetyParameters,
    velocities: Mapping[str, Array] | None = None,
    drifts: Mapping[str, Array] | None = None,
    shafts: Mapping[str, Shaft] = _NO_SHAFTS,
) -> Limited:
    """Return the part of a setpoint that is safe to send.

    velocities: measured ones [m/s; world], by robot, where known: braking starts later than without. drifts: motion
    beyond the commands [m/s; world], by robot: a robot in it is assumed to drift by up to `drift_m_s` more in any
    direction, and may be moved away from a wall to counter the drift, and back into the fence; None: nothing is added.
    shafts: of other robots;
    they are kept out of at any height. Each of two robots may use half of the closing speed between them, so that every
    robot is limited on its own.
    """
    reason = _unfit(robot, setpoint, belief, now_ns, parameters)
    if reason:
        return _hover(setpoint, reason)
    yaw = float(belief.mean_of(robot)[3])
    clipped, rate, names = _clip(robot, setpoint, parameters)
    velocity = world_from_stabilized(clipped, yaw)
    walls = walls_around(robot, belief, parameters, velocities or {}, shafts)
    drift = None if drifts is None else drifts.get(robot)
    walls = walls if drift is None else [held_off(wall, drift.tolist(), parameters) for wall in walls]
    if rate:
        walls += [turning(wall, rate, parameters.reaction_s) for wall in walls]
    limits = parameters.limits_of(robot)
    velocity, met = _nearest(velocity, walls, limits) if drift is None else _returning(velocity, walls, limits)
    names += [walls[i].name for i in met]
    vx, vy, vz = stabilized_from_world(velocity, yaw).tolist()
    limited = Setpoint((vx, vy, vz), float(rate), setpoint.phase, setpoint.blocked)
    return Limited(limited, tuple(dict.fromkeys(names)), setpoint.velocity_m_s)


def _returning(wanted: Array, walls: list[Wall], limits: MotionLimits) -> tuple[Array, list[int]]:
    """Return the nearest velocity that also leads back who is beyond the fence, as far as no wall loses by it.

    The largest such share of the way back is taken, so that it changes little from turn to turn.
    """
    found = _nearest(wanted, walls, limits)
    if not any(wall.back for wall in walls):
        return found
    allowed = [max(0.0, excess_m_s) + TOLERANCE_M_S for excess_m_s in _excesses(found[0], walls)]
    share, step = 1.0, 0.5
    for _ in range(_TRIALS):
        back = _nearest(wanted, [led_back(wall, share) for wall in walls], limits)
        if all(excess <= most for excess, most in zip(_excesses(back[0], walls), allowed, strict=True)):
            found = back
            if share == 1.0:
                break
            share += step
        else:
            share -= step
        step *= 0.5
    return found


def _excesses(velocity: Array, walls: list[Wall]) -> list[float]:
    x, y, z = velocity.tolist()
    return [dot(wall.normal, (x, y, z)) - wall.most for wall in walls]


def _nearest(wanted: Array, walls: list[Wall], limits: MotionLimits) -> tuple[Array, list[int]]:
    """Return the nearest velocity [world] that walls and limits allow, and the walls that limited it on the way."""
    x, y, z = wanted.tolist()
    if _is_slow(wanted, limits) and all(dot(wall.normal, (x, y, z)) <= wall.most for wall in walls):
        return wanted, []  # usually so, and arrays for it would take five times as long
    normals, most = np.array([wall.normal for wall in walls]), np.array([wall.most for wall in walls])
    velocity, met = project(wanted, normals, most)
    if not _is_slow(velocity, limits):  # two pushing walls at an acute angle meet far away
        speed = np.full(len(_ROUND), limits.max_speed_m_s * math.cos(math.pi / len(_ROUND)))
        climb = np.full(2, limits.max_climb_m_s)
        velocity, _ = project(wanted, np.concatenate((normals, _ROUND, _UP_DOWN)), np.concatenate((most, speed, climb)))
    return velocity, met


def _is_slow(velocity: Array, limits: MotionLimits) -> bool:
    across, climbs = math.hypot(velocity[0], velocity[1]), abs(velocity[2])
    return bool(across <= limits.max_speed_m_s + _ROUNDING_M_S and climbs <= limits.max_climb_m_s + _ROUNDING_M_S)


def _hover(setpoint: Setpoint, reason: str) -> Limited:
    wanted = setpoint.velocity_m_s if all(map(math.isfinite, setpoint.velocity_m_s)) else None
    return Limited(replace(setpoint, velocity_m_s=(0.0, 0.0, 0.0), yaw_rate_rad_s=0.0), (reason,), wanted)


def _unfit(robot: str, setpoint: Setpoint, belief: JointBelief, now_ns: int, parameters: SafetyParameters) -> str:
    """Return why the robot must hover, or nothing."""
    if robot not in belief.layout:
        return "unknown"
    if not all(math.isfinite(value) for value in (*setpoint.velocity_m_s, setpoint.yaw_rate_rad_s)):
        return "not finite"
    if not -0.1 <= (now_ns - belief.stamp_ns) * 1e-9 <= parameters.max_belief_age_s:
        return "stale"
    if not is_placed(belief, robot, parameters):
        return "uncertain"
    return "separation" if _coincides(robot, belief) else ""


def _coincides(robot: str, belief: JointBelief) -> bool:
    """Return whether another robot's estimate is at the same place: its direction is then unknown."""
    place = place_of(robot, belief)
    others = (place_of(other, belief) for other in belief.layout.robots if other != robot)
    return not all(math.dist(other, place) >= _NO_SIDE_M for other in others)


def _clip(robot: str, setpoint: Setpoint, parameters: SafetyParameters) -> tuple[Array, float, list[str]]:
    """Return velocity and yaw rate within the robot's motion limits, and which were exceeded."""
    limits, names = parameters.limits_of(robot), []
    velocity = np.array(setpoint.velocity_m_s)
    speed = math.hypot(velocity[0], velocity[1])
    if speed > limits.max_speed_m_s + _ROUNDING_M_S:
        velocity[:2] *= limits.max_speed_m_s / speed
        names.append("speed")
    if abs(velocity[2]) > limits.max_climb_m_s + _ROUNDING_M_S:
        velocity[2] = math.copysign(limits.max_climb_m_s, velocity[2])
        names.append("climb")
    rate = setpoint.yaw_rate_rad_s
    if abs(rate) > limits.max_yaw_rate_rad_s:
        rate = math.copysign(limits.max_yaw_rate_rad_s, rate)
        names.append("yaw rate")
    return velocity, rate, names

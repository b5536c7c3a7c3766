"""The last step before a setpoint is sent: shrinks a velocity or hovers; adds velocity only against a drift.

Why its half-spaces keep fence and separation for any wanted velocity: docs/explanation/safety.md#why-it-holds.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from groundstation.arrays import Array
from groundstation.control.half_spaces import project
from groundstation.control.parameters import SafetyParameters
from groundstation.control.setpoints import Setpoint
from groundstation.control.shafts import Shaft
from groundstation.control.view import is_placed
from groundstation.estimation.belief import JointBelief
from groundstation.geometry.stabilized_frame import stabilized_from_world, world_from_stabilized
from groundstation.planning.parameters import MotionLimits
from groundstation.vectors import Vector3, difference, dot

# No two bodies are this near to each other: if their estimates are, the direction between them is unknown.
_NO_SIDE_M = 0.1
# A shorter way has no direction.
_NOWHERE_M = 1e-6
_NO_SHAFTS: Mapping[str, Shaft] = MappingProxyType({})
# Number of sides of a polygon within the circle of the fastest horizontal velocities.
_ROUND = np.array([(math.cos(a), math.sin(a), 0.0) for a in np.arange(16) * (2.0 * math.pi / 16)])
# A velocity that was clipped to a limit, or asked for at it, may exceed it by this much.
_ROUNDING_M_S = 1e-10
_UP_DOWN = np.array(((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)))
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Limited:
    """A setpoint that may be sent, the names of the limits that changed it, and the wanted velocity, if finite.

    holds: it keeps a robot, hovering by order, at its place.
    """

    setpoint: Setpoint
    limited_by: tuple[str, ...] = ()
    wanted_m_s: Vector3 | None = None
    holds: bool = False


class _Wall(NamedTuple):
    """Velocity along the unit vector `normal` must not exceed `most` [m/s; world]."""

    name: str
    normal: Vector3
    most: float


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
    direction, and may be moved away from a wall to counter the drift; None: nothing is added. shafts: of other robots;
    they are kept out of at any height. Each of two robots may use half of the closing speed between them, so that every
    robot is limited on its own.
    """
    reason = _unfit(robot, setpoint, belief, now_ns, parameters)
    if reason:
        return _hover(setpoint, reason)
    yaw = float(belief.mean_of(robot)[3])
    clipped, rate, names = _clip(robot, setpoint, parameters)
    velocity = world_from_stabilized(clipped, yaw)
    known = velocities or {}
    walls = _fence(robot, belief, parameters, known) + _others(robot, belief, parameters, known)
    walls += _shafts(robot, belief, parameters, known, shafts)
    drift = None if drifts is None else drifts.get(robot)
    walls = walls if drift is None else [_held_off(wall, drift.tolist(), parameters) for wall in walls]
    if rate:
        walls += [_turning(wall, rate, parameters.reaction_s) for wall in walls]
    velocity, met = _nearest(velocity, walls, parameters.limits_of(robot))
    names += [walls[i].name for i in met]
    vx, vy, vz = stabilized_from_world(velocity, yaw).tolist()
    limited = Setpoint((vx, vy, vz), float(rate), setpoint.phase, setpoint.blocked)
    return Limited(limited, tuple(dict.fromkeys(names)), setpoint.velocity_m_s)


def _held_off(wall: _Wall, drift: Vector3, parameters: SafetyParameters) -> _Wall:
    """Return the wall for a robot that drifts: nearer by the possible drift, never demanding more than that."""
    allowed = min(parameters.drift_m_s + max(0.0, dot(drift, wall.normal)), parameters.most_drift_m_s)
    return _Wall(wall.name, wall.normal, wall.most - allowed)


def _nearest(wanted: Array, walls: list[_Wall], limits: MotionLimits) -> tuple[Array, list[int]]:
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


def _turning(wall: _Wall, rate: float, reaction_s: float) -> _Wall:
    """Return the wall for a vehicle that turns.

    A vehicle that holds its velocity v in its own frame carries it along when it turns: it flies v + T rate (z x v),
    for as long as its reaction T lags behind.
    """
    x, y, z = wall.normal
    turn = reaction_s * rate
    x, y = x + turn * y, y - turn * x
    size = math.hypot(x, y, z)
    return _Wall(wall.name, (x / size, y / size, z / size), wall.most / size)


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
    place = _place(robot, belief)
    others = (_place(other, belief) for other in belief.layout.robots if other != robot)
    return not all(math.dist(other, place) >= _NO_SIDE_M for other in others)


def _place(robot: str, belief: JointBelief) -> Vector3:
    x, y, z = belief.mean_of(robot)[:3].tolist()
    return x, y, z


def _covariance(robot: str, belief: JointBelief) -> Array:
    """Return the covariance (3, 3) of a place [m^2]."""
    return belief.covariance_of(robot)[:3, :3]


def _variances(robot: str, belief: JointBelief) -> list[float]:
    """Return the variances of x, y and z [m^2]."""
    variances: list[float] = _covariance(robot, belief).diagonal().tolist()
    return variances


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


def _braking(
    robot: str, belief: JointBelief, parameters: SafetyParameters, velocities: Mapping[str, Array]
) -> tuple[Vector3, float]:
    """Return the robot's point of rest (its place if the velocity is unknown), and the time in which to shed slack [s].

    A vehicle that follows a velocity c with lag T obeys d/dt (x + T v) = c: the point of rest is an integrator of the
    command. Without v the loop x' = v, v' = (slack / time - v) / T overshoots by 0.4 % of the slack at time = 3 T.
    """
    place, reaction_s = _place(robot, belief), parameters.reaction_s
    velocity = velocities.get(robot)
    if velocity is None:
        return place, 3.0 * reaction_s
    (x, y, z), (vx, vy, vz) = place, velocity.tolist()
    return (x + reaction_s * vx, y + reaction_s * vy, z + reaction_s * vz), 2.0 * reaction_s


def _fence(
    robot: str, belief: JointBelief, parameters: SafetyParameters, velocities: Mapping[str, Array]
) -> list[_Wall]:
    rest, time = _braking(robot, belief, parameters, velocities)
    walls = []
    for (low, high), normal, at, variance in zip(parameters.fence, _AXES, rest, _variances(robot, belief), strict=True):
        keep = parameters.margin_m + parameters.sigmas * math.sqrt(variance)
        walls.append(_Wall("fence", normal, max(0.0, high - keep - at) / time))
        walls.append(_Wall("fence", (-normal[0], -normal[1], -normal[2]), max(0.0, at - low - keep) / time))
    return walls


def _others(
    robot: str, belief: JointBelief, parameters: SafetyParameters, velocities: Mapping[str, Array]
) -> list[_Wall]:
    """Return two walls for each other robot: one at its point of rest, one at its place now.

    Half of the closing speed is this robot's share.
    """
    rest, time = _braking(robot, belief, parameters, velocities)
    place = _place(robot, belief)
    walls = []
    for other in belief.layout.robots:
        if other == robot:
            continue
        there, other_time = _braking(other, belief, parameters, velocities)
        covariance = _relative_covariance(robot, other, belief)
        apart = difference(_place(other, belief), place)
        for gap in (difference(there, rest), apart):
            walls.append(_apart(gap, apart, covariance, parameters, max(time, other_time)))
    return walls


def _shafts(
    robot: str,
    belief: JointBelief,
    parameters: SafetyParameters,
    velocities: Mapping[str, Array],
    shafts: Mapping[str, Shaft],
) -> list[_Wall]:
    """Return the two upright walls for each other robot's shaft."""
    rest, time = _braking(robot, belief, parameters, velocities)
    x, y, _ = _place(robot, belief)
    walls = []
    for other, shaft in shafts.items():
        if other == robot:
            continue
        covariance = _covariance(robot, belief) + shaft.variance * np.eye(3)
        rows: list[Vector3] = covariance.tolist()
        apart = (shaft.x - x, shaft.y - y, 0.0)
        # Right above it any direction leads out.
        apart = apart if math.hypot(*apart) > _NOWHERE_M else (_NOWHERE_M, 0.0, 0.0)
        for gap in ((shaft.x - rest[0], shaft.y - rest[1], 0.0), apart):
            walls.append(_apart(gap, apart, rows, parameters, time, shaft.drifted_m))
    return walls


def _apart(
    gap: Vector3, apart: Vector3, covariance: list[Vector3], parameters: SafetyParameters, time: float,
    more_m: float = 0.0,
) -> _Wall:  # fmt: skip
    """Return the wall that keeps a robot away from another; more_m: to be added to the separation."""
    normal, distance = _towards(gap, apart)
    keep = parameters.min_separation_m + parameters.margin_m + more_m
    keep += parameters.sigmas * _spread(covariance, normal)
    return _Wall("separation", normal, max(0.0, distance - keep) / (2.0 * time))


def _towards(gap: Vector3, apart: Vector3) -> tuple[Vector3, float]:
    """Return the direction to another robot and how far the gap extends in it; apart: the gap between the places.

    Points of rest of robots that fly at each other fast may coincide, or lie beyond each other. The gap between them
    then shows no direction, or the wrong one, in which both would retreat towards each other: the present one is used,
    and nothing is left of the distance.
    """
    distance = math.hypot(*gap)
    if not (distance > _NOWHERE_M and dot(gap, apart) > 0.0):
        gap, distance = apart, 0.0
    x, y, z = gap
    size = math.hypot(x, y, z)
    return (x / size, y / size, z / size), distance


def _relative_covariance(robot: str, other: str, belief: JointBelief) -> list[Vector3]:
    """Return the covariance (3, 3) of the vector from one robot to another [m^2]."""
    a, b = belief.layout.block(robot).start, belief.layout.block(other).start
    P = belief.covariance
    own, its, cross = P[a : a + 3, a : a + 3], P[b : b + 3, b : b + 3], P[a : a + 3, b : b + 3]
    rows: list[Vector3] = (own + its - cross - cross.T).tolist()
    return rows


def _spread(covariance: list[Vector3], normal: Vector3) -> float:
    """Return the standard deviation along a direction [m]."""
    x, y, z = (dot(row, normal) for row in covariance)
    return math.sqrt(max(0.0, dot((x, y, z), normal)))

"""The half-spaces of velocities that keep a robot in the fence, and away from obstacles and others. Pure.

Why they do: docs/explanation/safety.md#why-it-holds.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from groundstation.arrays import Array
from groundstation.control.parameters import SafetyParameters
from groundstation.control.shafts import Shaft
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import Box
from groundstation.vectors import Vector3, difference, dot

# Beyond the fence a robot is led back at 1.5 times its distance a second, up to `return_m_s`. With what counters drifts
# that is 0.1 m/s or more until 0.05 m beyond, as its driver expects of one on its way back (drivers/fence.py).
_RETURN_GAIN_PER_S = 1.5
# A shorter way has no direction.
_NOWHERE_M = 1e-6
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
# Directions into a box through each of its faces.
_INWARDS = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))


class Wall(NamedTuple):
    """Velocity along the unit vector `normal` must not exceed `most` [m/s; world].

    back: by how much less it should be of a robot that is beyond the wall, where all other walls allow that.
    """

    name: str
    normal: Vector3
    most: float
    back: float = 0.0


def walls_around(
    robot: str,
    belief: JointBelief,
    parameters: SafetyParameters,
    velocities: Mapping[str, Array],
    shafts: Mapping[str, Shaft],
) -> list[Wall]:
    """Return the walls of a robot's fence, of each obstacle, of each other robot in the belief, and of each shaft."""
    rest, time = _braking(robot, belief, parameters, velocities)
    walls = _fence(robot, belief, parameters, rest, time) + _obstacles(robot, belief, parameters, rest, time)
    walls += _others(robot, belief, parameters, velocities, rest, time)
    return walls + _shafts(robot, belief, parameters, shafts, rest, time)


def held_off(wall: Wall, drift: Vector3, parameters: SafetyParameters) -> Wall:
    """Return the wall for a robot that drifts: nearer by the possible drift, never demanding more than that."""
    allowed = min(parameters.drift_m_s + max(0.0, dot(drift, wall.normal)), parameters.most_drift_m_s)
    return wall._replace(most=wall.most - allowed)


def led_back(wall: Wall, share: float) -> Wall:
    """Return the wall that leads a robot beyond it back, at a share of the speed."""
    return wall._replace(most=wall.most - share * wall.back)


def turning(wall: Wall, rate: float, reaction_s: float) -> Wall:
    """Return the wall for a vehicle that turns.

    A vehicle that holds its velocity v in its own frame carries it along when it turns: it flies v + T rate (z x v),
    for as long as its reaction T lags behind.
    """
    x, y, z = wall.normal
    turn = reaction_s * rate
    x, y = x + turn * y, y - turn * x
    size = math.hypot(x, y, z)
    return Wall(wall.name, (x / size, y / size, z / size), wall.most / size, wall.back / size)


def place_of(robot: str, belief: JointBelief) -> Vector3:
    """Return a robot's estimated place [m; world]."""
    x, y, z = belief.mean_of(robot)[:3].tolist()
    return x, y, z


def _covariance(robot: str, belief: JointBelief) -> Array:
    """Return the covariance (3, 3) of a place [m^2]."""
    return belief.covariance_of(robot)[:3, :3]


def _variances(robot: str, belief: JointBelief) -> list[float]:
    """Return the variances of x, y and z [m^2]."""
    variances: list[float] = _covariance(robot, belief).diagonal().tolist()
    return variances


def _braking(
    robot: str, belief: JointBelief, parameters: SafetyParameters, velocities: Mapping[str, Array]
) -> tuple[Vector3, float]:
    """Return the robot's point of rest (its place if the velocity is unknown), and the time in which to shed slack [s].

    A vehicle that follows a velocity c with lag T obeys d/dt (x + T v) = c: the point of rest is an integrator of the
    command. Without v the loop x' = v, v' = (slack / time - v) / T overshoots by 0.4 % of the slack at time = 3 T.
    """
    place, reaction_s = place_of(robot, belief), parameters.reaction_s
    velocity = velocities.get(robot)
    if velocity is None:
        return place, 3.0 * reaction_s
    (x, y, z), (vx, vy, vz) = place, velocity.tolist()
    return (x + reaction_s * vx, y + reaction_s * vy, z + reaction_s * vz), 2.0 * reaction_s


def _fence(robot: str, belief: JointBelief, parameters: SafetyParameters, rest: Vector3, time: float) -> list[Wall]:
    """Return the fence's walls; the bottom leads nobody back: flights begin and end below it."""
    walls, place, variances = [], place_of(robot, belief), _variances(robot, belief)
    for axis, (low, high) in enumerate(parameters.fence):
        normal, at, here = _AXES[axis], rest[axis], place[axis]
        keep = parameters.margin_m + parameters.sigmas * math.sqrt(variances[axis])
        beneath_m = 0.0 if axis == 2 else low - here
        inwards = (-normal[0], -normal[1], -normal[2])
        walls.append(Wall("fence", normal, max(0.0, high - keep - at) / time, _back(here - high, parameters)))
        walls.append(Wall("fence", inwards, max(0.0, at - low - keep) / time, _back(beneath_m, parameters)))
    return walls


def _back(beyond_m: float, parameters: SafetyParameters) -> float:
    """Return the speed at which to lead a robot back that is so far beyond the fence."""
    return min(parameters.return_m_s, _RETURN_GAIN_PER_S * max(0.0, beyond_m))


def _obstacles(robot: str, belief: JointBelief, parameters: SafetyParameters, rest: Vector3, time: float) -> list[Wall]:
    """Return a wall for each obstacle: the side, or the top, of which the robot's point of rest is farthest outside."""
    if not parameters.obstacles:
        return []
    place, keep = place_of(robot, belief), parameters.obstacle_distance_m + parameters.margin_m
    x, y, z = (keep + parameters.sigmas * math.sqrt(variance) for variance in _variances(robot, belief))
    walls = []
    for box in parameters.obstacles:
        gaps = [gap - kept for gap, kept in zip(_gaps(box, rest), (x, x, y, y, z), strict=True)]
        # Beyond a thin box a point of rest shows no way through it.
        outside = [side for side, gap in enumerate(_gaps(box, place)) if gap > 0.0]
        side = max(outside or range(len(gaps)), key=gaps.__getitem__)
        walls.append(Wall("obstacle", _INWARDS[side], max(0.0, gaps[side]) / time))
    return walls


def _gaps(box: Box, place: Vector3) -> tuple[float, float, float, float, float]:
    """Return how far a place is outside of each face of a box, in the order of _INWARDS [m; negative: behind it]."""
    (x, y), (length, width, height) = box.centre_m, box.size_m
    across, along = place[0] - x, place[1] - y
    return -across - length / 2, across - length / 2, -along - width / 2, along - width / 2, place[2] - height


def _others(
    robot: str, belief: JointBelief, parameters: SafetyParameters, velocities: Mapping[str, Array], rest: Vector3,
    time: float,
) -> list[Wall]:  # fmt: skip
    """Return two walls for each other robot: at its point of rest, and at its present place.

    Half of the closing speed is this robot's share.
    """
    place = place_of(robot, belief)
    walls = []
    for other in belief.layout.robots:
        if other == robot:
            continue
        there, other_time = _braking(other, belief, parameters, velocities)
        covariance = _relative_covariance(robot, other, belief)
        apart = difference(place_of(other, belief), place)
        for gap in (difference(there, rest), apart):
            walls.append(_apart(gap, apart, covariance, parameters, max(time, other_time)))
    return walls


def _shafts(
    robot: str, belief: JointBelief, parameters: SafetyParameters, shafts: Mapping[str, Shaft], rest: Vector3,
    time: float,
) -> list[Wall]:  # fmt: skip
    """Return the two upright walls for each other robot's shaft."""
    x, y, _ = place_of(robot, belief)
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
) -> Wall:  # fmt: skip
    """Return the wall that keeps a robot away from another; more_m: to be added to the separation."""
    normal, distance = _towards(gap, apart)
    keep = parameters.min_separation_m + parameters.margin_m + more_m
    keep += parameters.sigmas * _spread(covariance, normal)
    return Wall("separation", normal, max(0.0, distance - keep) / (2.0 * time))


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

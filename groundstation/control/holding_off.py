"""Departures from the plan: to make room for returning robots, and to stay where the robot itself can return."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from groundstation.arrays import Array
from groundstation.control.excursion import within_reach
from groundstation.control.moment import STILL, Moment, is_untied, soon
from groundstation.control.view import spread_m
from groundstation.geometry.stabilized_frame import stabilized_from_world, world_from_stabilized

# Standard deviations of a returning robot's place that others leave as room: two for the separation, one to spare.
_ROOM_SIGMAS = 3.0
_ROOM_GAIN = 1.0  # of the missing distance [1/s]


def giving_way(name: str, velocity: tuple[float, float], coming: Sequence[str], now: Moment) -> tuple[float, float]:
    """Return the velocity [base_stabilized] of a robot that makes room for returning robots.

    Their places are uncertain, so the separation limit keeps them far off: a robot that hovers in the middle of the
    view would keep them out of it.
    """
    mean, wanted = now.belief.mean_of(name), np.array(velocity)
    for other in (one for one in coming if one != name):
        away = mean[:2] - now.belief.mean_of(other)[:2]
        distance = max(float(np.linalg.norm(away)), 1e-6)
        lacking_m = now.parameters.column_m + _ROOM_SIGMAS * spread_m(now.belief, other) - distance
        if lacking_m <= 0.0:
            continue
        off = stabilized_from_world(np.append(away / distance, 0.0), float(mean[3]))[:2]
        least = min(now.parameters.search_speed_m_s, _ROOM_GAIN * lacking_m)
        wanted = wanted + max(0.0, least - float(off @ wanted)) * off
    return float(wanted[0]), float(wanted[1])


def recoverable(name: str, velocity: tuple[float, float], now: Moment) -> tuple[float, float]:
    """Return the part of a velocity [base_stabilized] with which a robot could still come back if it got lost.

    A robot that flies on our estimate turns back as soon as no sensor locates it: it would land before it is lost.
    """
    error_m_s = now.sight.velocity_errors_m_s.get(name, 0.0)
    drift = now.sight.drifts_m_s.get(name, STILL)[:2]
    if is_untied(name, now):
        error_m_s, drift = math.inf, STILL[:2]  # the drift was measured against a place that is no longer known
    if error_m_s <= now.parameters.sound_error_m_s:
        return velocity
    near = soon(name, now)
    return held(
        name, velocity, now,
        lambda wanted: within_reach(wanted, name, now.belief, now.parameters, now.sensors, error_m_s, drift, near),
    )  # fmt: skip


def held(name: str, velocity: tuple[float, float], now: Moment, limit: Callable[[Array], Array]) -> tuple[float, float]:
    """Return a velocity [base_stabilized] after a limit of velocities (2) [world] was applied to it."""
    yaw = float(now.belief.mean_of(name)[3])
    wanted = world_from_stabilized(np.array([*velocity, 0.0]), yaw)
    forward, left, _ = stabilized_from_world(np.append(limit(wanted[:2]), 0.0), yaw).tolist()
    return forward, left

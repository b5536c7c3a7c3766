"""Keeps robots that fly on our estimate in view of world-fixed sensors: velocity, climb, and ways between views."""

import math

import numpy as np

from groundstation.arrays import Array
from groundstation.control.crossing import (
    RUN_UP_M,
    Passage,
    gap_about_m,
    hold,
    into,
    is_inside,
    passage,
    unseen_way_m,
    view_around,
)
from groundstation.control.excursion import box_about_views
from groundstation.control.holding_off import held
from groundstation.control.moment import FOLLOWS_S, STILL, Moment, at_rest, soon
from groundstation.sensing.models import Rectangle

Kept = tuple[Array, float]

# Views are narrower higher up, and a climbing vehicle rises on by this much before it holds its height.
_RISES_ON_M = 0.3
# An unseen vehicle's place is known for a second; then it is sent no estimate, hovers, and lands 0.7 s later (0214).
_UNSEEN_S = 1.0
# Least distance [m] that the separation limits allow two robots, and closing speed per remaining distance [1/s].
_APART_M, _CLOSING_GAIN = 0.8, 0.5
_SINKS_M, _SINK_STEPS = 0.1, 6  # down to a level at which a gap is short enough


def kept_in_sight(
    name: str, velocity: tuple[float, float], level_m: float, ahead_m: float, now: Moment
) -> tuple[tuple[float, float], float]:
    """Return velocity [base_stabilized] and level [m] with which a robot is never unseen for longer than it can afford.

    It stays in its view, taken at the height to which it climbs, and leaves it only towards another view that it
    reaches in time: straight, at full speed, and without a climb. A robot that others locate may be anywhere between
    views that are farther apart. ahead_m: how far the robot is about to go.
    """
    if name not in now.parameters.fed:
        return velocity, level_m
    kept = level_m

    def limit(wanted: Array) -> Array:
        nonlocal kept
        limited, kept = _kept(name, wanted, level_m, ahead_m, now)
        return limited

    return held(name, velocity, now, limit), kept


def _kept(name: str, wanted: Array, level_m: float, ahead_m: float, now: Moment) -> Kept:
    """Return the same as `kept_in_sight` for a velocity (2) [world]."""
    place, z = now.belief.mean_of(name)[:2], float(now.belief.mean_of(name)[2])
    views = _views(name, z, now)
    if not views:
        return wanted, level_m
    if not is_inside(place, views):
        return _outside(name, wanted, level_m, views, now)
    most, found = now.parameters.limits_of(name).max_speed_m_s, passage(place, wanted, views)
    if found is None:
        return _held_in(name, wanted, level_m, now)
    short_m, helped = _short_m(name, found, now), _is_helped(name, now)
    # A robot that others locate does not stay in the gap, even if its setpoints would: half of the way is enough.
    needed_m = 0.5 * (found.leaves_m + found.reaches_m) if helped else found.reaches_m
    crosses = needed_m <= ahead_m * found.share
    if found.gap_m > short_m and helped:
        return _in_box(name, wanted, level_m, now)
    if found.gap_m > short_m and crosses:
        level_m = _level_of_a_gap(name, wanted, short_m, level_m, now)
    if found.gap_m > short_m or not crosses:
        return _held_in(name, wanted, level_m, now)
    if found.gap_m == 0.0 or found.leaves_m > RUN_UP_M:
        return wanted, _climbed(name, level_m, now)
    return most * found.way, _sunk(z, level_m, now)


def _short_m(name: str, found: Passage, now: Moment) -> float:
    """Return the widest gap that a robot crosses in time [m], from its place or from the begin of its run-up."""
    speed = float(now.sight.velocities_m_s.get(name, STILL)[:2] @ found.way)
    return unseen_way_m(
        min(found.leaves_m, RUN_UP_M), max(0.0, speed), _pace_m_s(name, found, now), FOLLOWS_S, _UNSEEN_S
    )


def _pace_m_s(name: str, found: Passage, now: Moment) -> float:
    """Return a robot's speed along a passage [m/s]: its maximum, less for an adverse drift or a robot in its way."""
    way = np.append(found.way, 0.0)
    pace = now.parameters.limits_of(name).max_speed_m_s
    pace += min(0.0, float(now.sight.drifts_m_s.get(name, STILL) @ way))
    for other in (one for one in now.robots if one != name):
        apart = now.belief.mean_of(other)[:3] - (now.belief.mean_of(name)[:3] + found.reaches_m * way)
        distance = max(float(np.linalg.norm(apart)), 1e-6)
        towards = float(apart @ way) / distance
        if towards > 0.0:
            pace = min(pace, _CLOSING_GAIN * max(0.0, distance - _APART_M) / towards)
    return max(0.0, pace)


def _outside(name: str, wanted: Array, level_m: float, views: tuple[Rectangle, ...], now: Moment) -> Kept:
    """Return velocity and level that bring a robot outside all views into the one ahead of it."""
    mean, most = now.belief.mean_of(name), now.parameters.limits_of(name).max_speed_m_s
    place, gap_m = mean[:2], gap_about_m(mean[:2], views)
    if math.isfinite(gap_m) and gap_m > _UNSEEN_S * most and _is_helped(name, now):
        return _in_box(name, wanted, level_m, now)
    ahead = soon(name, now)
    view = min(views, key=lambda one: math.dist(ahead, one.nearest(*ahead)))
    return into(view, place, wanted, most), _sunk(float(mean[2]), level_m, now)


def is_between_views(name: str, now: Moment) -> bool:
    """Return whether a robot that flies on our estimate is in none of the views at its height."""
    mean = now.belief.mean_of(name)
    views = _views(name, float(mean[2]), now)
    return name in now.parameters.fed and bool(views) and not is_inside(mean[:2], views)


def _held_in(name: str, wanted: Array, level_m: float, now: Moment) -> Kept:
    """Return velocity and level that keep a robot in its view at the height to which it climbs."""
    place, z = now.belief.mean_of(name)[:2], float(now.belief.mean_of(name)[2])
    view = view_around(place, _views(name, max(level_m, z), now))
    return _held_by(view, name, wanted, now), _climbed(name, level_m, now)


def _in_box(name: str, wanted: Array, level_m: float, now: Moment) -> Kept:
    """Return velocity and level that keep a robot seen by others in the box about all views."""
    x, y, z = (float(value) for value in now.belief.mean_of(name)[:3])
    kept = _held_by(box_about_views(name, now.belief, now.sensors, max(level_m, z)), name, wanted, now)
    box = box_about_views(name, now.belief, now.sensors, max(z, min(level_m, z + _RISES_ON_M)))
    rises = box is None or box.nearest(x, y) == (x, y)
    return kept, level_m if rises else min(level_m, z)


def _held_by(view: Rectangle | None, name: str, wanted: Array, now: Moment) -> Array:
    return wanted if view is None else hold(view, at_rest(name, now), wanted, now.parameters.return_speed_m_s)


def _climbed(name: str, level_m: float, now: Moment) -> float:
    """Return the level of a robot in view: it climbs only if it is in a view at that height too."""
    mean = now.belief.mean_of(name)
    z = float(mean[2])
    if level_m <= z:
        return level_m
    views = _views(name, min(level_m, z + _RISES_ON_M), now)
    return level_m if is_inside(mean[:2], views) else z


def _sunk(z: float, level_m: float, now: Moment) -> float:
    """Return the level of a robot between two views: with its height held, a climbing robot would rise on (0213)."""
    return min(level_m, z - now.parameters.height_tolerance_m)


def _level_of_a_gap(name: str, wanted: Array, short_m: float, level_m: float, now: Moment) -> float:
    """Return a lower level at which the gap is short enough, or `level_m` if there is none near."""
    mean = now.belief.mean_of(name)
    for step in range(1, _SINK_STEPS + 1):
        lower_m = float(mean[2]) - step * _SINKS_M
        found = passage(mean[:2], wanted, _views(name, lower_m, now))
        if found is not None and found.gap_m <= short_m:
            return min(level_m, lower_m)
    return level_m


def _is_helped(name: str, now: Moment) -> bool:
    return now.sight.helped_s.get(name, math.inf) <= now.parameters.untied_after_s


def _views(name: str, height_m: float, now: Moment) -> tuple[Rectangle, ...]:
    return now.sensors.root_views(height_m + now.sensors.marker_height_m[name])

"""Setpoints of all robots from a plan: held velocities, heights of levels, and returns and searches when needed."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from groundstation.bus.messages import Vector3
from groundstation.control.flight_mode import FlightMode, Situation, flight_mode_of
from groundstation.control.holding_off import giving_way, recoverable
from groundstation.control.in_sight import is_between_views, kept_in_sight
from groundstation.control.moment import STILL, Moment, Sight, is_untied, soon, steered
from groundstation.control.parameters import ControlParameters
from groundstation.control.regaining import regaining, who_regains
from groundstation.control.returning import is_lost, return_stand
from groundstation.control.scouting import scout_of
from groundstation.control.search_spacing import apart
from groundstation.control.stand import Stand
from groundstation.control.view import spread_m, view_of
from groundstation.estimation.belief import JointBelief
from groundstation.geometry.angles import difference
from groundstation.geometry.stabilized_frame import stabilized_from_world, world_from_stabilized
from groundstation.planning.planner import PlanResult
from groundstation.sensing.models import SensorSuite

_STAND_GAIN, _TURN_GAIN = 1.0, 1.5  # of the distance and the turn to a stand [1/s]


@dataclass(frozen=True, slots=True)
class Setpoint:
    """A robot's wanted velocity [m/s; base_stabilized] and yaw rate [rad/s], before the output limiter.

    blocked: the robot that holds up a change of height.
    """

    velocity_m_s: Vector3
    yaw_rate_rad_s: float
    phase: FlightMode
    blocked: str = ""


NOTHING_SEEN = Sight()
HOVER = Setpoint((0.0, 0.0, 0.0), 0.0, FlightMode.UNKNOWN)


def setpoints_from_plan(
    plan: PlanResult | None,
    belief: JointBelief,
    airborne: Collection[str],
    parameters: ControlParameters,
    sensors: SensorSuite,
    sight: Sight = NOTHING_SEEN,
) -> dict[str, Setpoint]:
    """Return a setpoint for every airborne robot; plan: the last valid one, or None."""
    now = Moment(belief, [name for name in belief.layout.robots if name in airborne], parameters, sensors, sight)
    phases = _phases(plan, airborne, now)
    able = [name for name in steered(now.robots, now) if phases[name] is FlightMode.SEARCH]
    stands = _stands(phases, sight.search(able, sight.missing), now)
    coming = [name for name in now.robots if _comes_back(name, phases[name], now)]
    wanted: dict[str, Setpoint] = {}
    for name, phase in phases.items():
        if phase is FlightMode.UNKNOWN:
            wanted[name] = HOVER
        elif phase is FlightMode.TRACK and plan is not None:
            wanted[name] = _planned(name, plan, coming, now)
        else:
            wanted[name] = _towards(name, stands[name], phase, now)
    return wanted


def _phases(plan: PlanResult | None, airborne: Collection[str], now: Moment) -> dict[str, FlightMode]:
    """Return each robot's flight mode; one that tracks is spared for the search if a target is missing."""
    age_s = now.sight.target_age_s
    fresh = age_s is not None and age_s <= now.parameters.lost_after_s and bool(now.belief.layout.targets)
    phases = {
        name: flight_mode_of(
            Situation(
                in_belief=name in now.robots,
                lost=name in now.robots and (_is_lost(name, now) or (not fresh and is_untied(name, now))),
                target_fresh=fresh,
                planned=plan is not None and name in plan.controls,
            )
        )
        for name in airborne
    }
    if plan is None or not fresh or not now.sight.missing:
        return phases
    scout = scout_of([name for name in now.robots if phases[name] is FlightMode.TRACK], plan.topology, now)
    return phases if scout is None else phases | {scout: FlightMode.SEARCH}


def _planned(name: str, plan: PlanResult, coming: Sequence[str], now: Moment) -> Setpoint:
    """Return the plan's setpoint within the robot's limits: it makes room for returning robots, and stays in view."""
    vx, vy, rate = _regained(name, plan, now)
    level_m = _level_m(name, plan.heights[name], now)
    velocity = recoverable(name, giving_way(name, (vx, vy), coming, now), now)
    ahead_m = now.parameters.planned_s * math.hypot(*velocity)
    velocity, level_m = kept_in_sight(name, velocity, level_m, ahead_m, now)
    return _with_height(name, velocity, rate, level_m, FlightMode.TRACK, now)


def _comes_back(name: str, phase: FlightMode, now: Moment) -> bool:
    """Return whether a robot is flying back into a view and follows setpoints."""
    comes = phase is FlightMode.RETURN or (
        phase is FlightMode.TRACK and (is_untied(name, now) or is_between_views(name, now))
    )
    return comes and name not in now.sight.unsteered


def _regained(name: str, plan: PlanResult, now: Moment) -> tuple[float, float, float]:
    """Return the plan's velocity and yaw rate, or those that bring an unseen target back into the robot's picture.

    PAPER (docs/explanation/method.md 7): plans assume level robots; a robot that brakes before a target tips it out of
    its picture, and no plan corrects that.
    """
    vx, vy, rate = (float(value) for value in plan.controls[name])
    belief, age_s = now.belief, now.sight.target_age_s
    if age_s is None or age_s <= now.parameters.regain_after_s:
        return vx, vy, rate
    place = belief.mean_of(name)[:2]
    tracked = (one for one in belief.layout.targets if one not in now.sight.missing)
    target = min(tracked, key=lambda one: math.dist(belief.mean_of(one)[:2], place))
    found = regaining(name, target, belief, now.sensors)
    able = steered(now.robots, now)
    if found is None or name not in who_regains(target, plan.topology, belief, now.sensors, able):
        return vx, vy, rate
    (vx, vy), rate = found[0].tolist(), found[1]
    return vx, vy, rate


def _level_m(name: str, level_m: float, now: Moment) -> float:
    """Return a robot's height [m]; while it looks for a view it sinks a little, for views are narrower higher up.

    With its height held, a climbing vehicle would rise on, because its climb rate is in error as well.
    """
    if not is_untied(name, now):
        return level_m
    return min(level_m, float(now.belief.mean_of(name)[2]) - now.parameters.height_tolerance_m)


def _search_level_m(name: str, phase: FlightMode, now: Moment) -> float:
    """Return the height at which a robot searches or returns.

    One that flies on our estimate climbs only where it is in a view at that height too, else it would leave its view.
    """
    x, y, z = (float(value) for value in now.belief.mean_of(name)[:3])
    level_m = now.parameters.return_height_m if phase is FlightMode.RETURN else now.parameters.search_height_m
    view = view_of(x, y, name, level_m, now.sensors) if name in now.parameters.fed else None
    inside = view is None or view.nearest(x, y) == (x, y)
    return _level_m(name, level_m if inside else min(level_m, z), now)


def _is_lost(name: str, now: Moment) -> bool:
    unseen_s, error_m_s = now.sight.unseen_s.get(name, 0.0), now.sight.velocity_errors_m_s.get(name, 0.0)
    returns = now.sight.before.get(name) is FlightMode.RETURN
    return name in now.sight.missed_s or is_lost(
        name, now.belief, now.parameters, now.sensors, unseen_s, error_m_s, returns
    )


def _stands(phases: Mapping[str, FlightMode], searching: Mapping[str, Stand], now: Moment) -> dict[str, Stand]:
    """Return a stand for each robot that returns or searches, apart from each other; returning robots choose first.

    A searching robot without a place to go waits in view. One that follows no setpoints stays where it is, and all
    others give way.
    """
    robots = [name for name in now.robots if phases[name] in (FlightMode.RETURN, FlightMode.SEARCH)]
    means = {name: now.belief.mean_of(name) for name in robots}
    places = {name: (float(mean[0]), float(mean[1])) for name, mean in means.items()}
    height_m = now.parameters.return_height_m
    views = {name: view_of(*soon(name, now), name, height_m, now.sensors) for name in robots}
    able = steered(robots, now)
    held = {name: return_stand(means[name], None) for name in robots if name not in able}
    back = {
        name: return_stand(means[name], views[name], now.sight.missed_s.get(name, 0.0))
        for name in able
        if phases[name] is FlightMode.RETURN
    }
    out = {
        name: _risen_in_view(name, searching[name], now)
        for name in able
        if phases[name] is FlightMode.SEARCH and name in searching
    }
    idle = {
        name: return_stand(means[name], views[name])
        for name in able
        if phases[name] is FlightMode.SEARCH and name not in searching
    }
    within = {name: None if name in out or name in held else view for name, view in views.items()}
    return apart(held | back | out | idle, places, within, now.parameters.column_m)


def _risen_in_view(name: str, stand: Stand, now: Moment) -> Stand:
    """Return the place for a search of a robot that flies on our estimate: in its view, until it is as high as one.

    It climbs only there (`_search_level_m`), and from below it sees less than the search counts on.
    """
    height_m = now.parameters.search_height_m
    low = float(now.belief.mean_of(name)[2]) < height_m - now.parameters.height_tolerance_m
    if name not in now.parameters.fed or not low:
        return stand
    view = view_of(*soon(name, now), name, height_m, now.sensors)
    if view is None:
        return stand
    x, y = view.nearest(stand.x, stand.y)
    return replace(stand, x=x, y=y)


def _towards(name: str, stand: Stand, phase: FlightMode, now: Moment) -> Setpoint:
    """Return a setpoint that flies to a stand and turns to its heading, past obstacles and keeping off other robots.

    From a returning robot's velocity its drift is subtracted, up to the largest credible one.
    """
    mean, parameters = now.belief.mean_of(name), now.parameters
    drift_m_s = now.sight.drifts_m_s.get(name, STILL) if phase is FlightMode.RETURN else STILL
    x, y, z = (float(value) for value in mean[:3])
    way = parameters.detours.way((x, y), (stand.x, stand.y), z, spread_m(now.belief, name))
    most = parameters.return_speed_m_s if phase is FlightMode.RETURN else parameters.search_speed_m_s
    velocity = _STAND_GAIN * np.array([way.next_m[0] - x, way.next_m[1] - y, 0.0])
    speed = max(float(np.linalg.norm(velocity)), 1e-9)
    velocity *= min(1.0 if way.is_straight else way.length_m / speed, most / speed)
    size = float(np.hypot(*drift_m_s[:2]))
    velocity[:2] -= drift_m_s[:2] * min(1.0, parameters.return_drift_m_s / max(size, 1e-9))
    for other in now.robots:
        away = mean[:2] - now.belief.mean_of(other)[:2]
        distance = float(np.linalg.norm(away))
        if other != name and distance < parameters.column_m:
            nearness = 1.0 - distance / parameters.column_m
            velocity[:2] += parameters.search_speed_m_s * 2 * nearness * away / max(distance, 0.05)
    rate = _TURN_GAIN * difference(stand.yaw, float(mean[3])) + stand.yaw_rate
    limit = stand.turn_rad_s or parameters.search_yaw_rate_rad_s
    body = stabilized_from_world(velocity, float(mean[3]))
    rate = min(max(rate, -limit), limit)
    ahead_m, level_m = way.length_m, _search_level_m(name, phase, now)
    kept, level_m = kept_in_sight(name, (float(body[0]), float(body[1])), level_m, ahead_m, now)
    return _with_height(name, kept, rate, level_m, phase, now)


def _with_height(
    name: str, velocity: tuple[float, float], rate: float, level_m: float, phase: FlightMode, now: Moment
) -> Setpoint:
    """Return the setpoint with the climb towards its level height; near another robot it first moves aside."""
    belief, parameters = now.belief, now.parameters
    mean = belief.mean_of(name)
    climb = parameters.limits_of(name).max_climb_m_s
    way = level_m - float(mean[2])
    vz = min(max(parameters.height_gain_per_s * way, -climb), climb)
    if abs(way) <= parameters.height_tolerance_m:
        return Setpoint((*velocity, vz), rate, phase)
    near = _nearest(name, now)
    if near is None or near[1] >= parameters.column_m:
        return Setpoint((*velocity, vz), rate, phase)
    other, distance = near
    away = np.append((mean[:2] - belief.mean_of(other)[:2]) / max(distance, 0.05), 0.0)
    if distance < 0.05:
        away = world_from_stabilized(np.array([-1.0, 0.0, 0.0]), float(mean[3]))
    outward = stabilized_from_world(away, float(mean[3]))[:2]
    held = np.array(velocity)
    held += max(0.0, parameters.side_step_m_s - float(held @ outward)) * outward
    ahead_m = now.parameters.planned_s * math.hypot(*held)
    aside, _ = kept_in_sight(name, (float(held[0]), float(held[1])), level_m, ahead_m, now)
    return Setpoint((*aside, 0.0), rate, phase, blocked=other)


def _nearest(name: str, now: Moment) -> tuple[str, float] | None:
    """Return the other robot that is horizontally closest, with its distance."""
    mean = now.belief.mean_of(name)
    distances = {
        other: float(np.hypot(*(now.belief.mean_of(other)[:2] - mean[:2]))) for other in now.robots if other != name
    }
    return min(distances.items(), key=lambda entry: entry[1]) if distances else None

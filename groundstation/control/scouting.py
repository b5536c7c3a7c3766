"""The robot that is spared from tracking to search for a missing target, if the others stay located without it."""

import math
from collections.abc import Mapping, Sequence

from groundstation.arrays import Array
from groundstation.control.flight_mode import FlightMode
from groundstation.control.moment import Moment, steered
from groundstation.sensing.topology import Topology

_FARTHER_M = 0.5  # another robot takes over only if it is farther from the targets by this much
_OUTSIDE_M = 0.3  # of a view: a robot is back in it at once


def scout_of(tracking: Sequence[str], topology: Topology, now: Moment) -> str | None:
    """Return the tracking robot that searches, the farthest from the tracked targets; None if none can be spared.

    Others go on tracking, the nearest among them, and stay located: in a world-fixed view until the scout could be
    back, or below a robot that is. topology: of the plan in force. The robot that searched before goes on.
    """
    belief = now.belief
    seen = [belief.mean_of(name) for name in belief.layout.targets if name not in now.sight.missing]
    able = steered(tracking, now)
    if len(able) < 2 or not seen:
        return None

    def way_m(name: str) -> float:
        bonus_m = _FARTHER_M if _searched(name, now) else 0.0
        return bonus_m + min(math.dist(belief.mean_of(name)[:2], target[:2]) for target in seen)

    nearest, levels = min(able, key=way_m), topology.level_by_robot()
    sees = [name for name in able if name != nearest and name not in now.sight.blind]
    spared = [name for name in sees if _can_be_spared(name, tracking, levels, seen, now)]
    return max(spared, key=way_m, default=None)


def _searched(name: str, now: Moment) -> bool:
    return now.sight.before.get(name) is FlightMode.SEARCH


def _can_be_spared(
    name: str, tracking: Sequence[str], levels: Mapping[str, int], seen: Sequence[Array], now: Moment
) -> bool:
    """Return whether all other tracking robots stay located without one, and some of the level that sees the targets.

    Before a scout leaves, robots that a view locates must be in it. Afterwards a little outside is near enough, since a
    robot at the border of a view would otherwise call the scout back again and again.
    """
    outside_m, place = _OUTSIDE_M if _searched(name, now) else 0.0, now.belief.mean_of(name)[:2]
    others = [other for other in tracking if other != name]
    located = {other for other in others if _from_views_m(other, place, seen, now) <= outside_m}
    for other in sorted(others, key=lambda one: levels.get(one, 0)):
        if any(levels.get(eye, 0) == levels.get(other, 0) - 1 for eye in located):
            located.add(other)
    lowest = max(levels.values(), default=0)
    return located.issuperset(others) and any(levels.get(other, 0) == lowest for other in others)


def _from_views_m(name: str, scout: Array, seen: Sequence[Array], now: Moment) -> float:
    """Return how far a robot is outside all world-fixed views, or will be before a scout is back [m].

    It moves as its target does. scout: its place (2) [m]; seen: means of the targets. Infinite without views.
    """
    mean = now.belief.mean_of(name)
    target = min(seen, key=lambda one: math.dist(one[:2], mean[:2]))
    back_s = math.dist(scout, mean[:2]) / now.parameters.search_speed_m_s
    views = now.sensors.root_views(float(mean[2]) + now.sensors.marker_height_m[name])
    (x, y), (vx, vy) = mean[:2].tolist(), target[2:4].tolist()
    places = ((x, y), (x + back_s * vx, y + back_s * vy))
    return max(min((math.dist(at, view.nearest(*at)) for view in views), default=math.inf) for at in places)

"""A robot's crossing from one world-fixed view into the next, through a gap in which it is unseen. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.sensing.models import Rectangle

RUN_UP_M = 0.3  # before the border: a vehicle needs this distance to reach its speed
_INSET_M = 0.1  # inside the border, where it is certainly seen
HOLD_GAIN = 1.0  # of the distance to the border [1/s]
_GAIN = 3.0  # of the remaining way into the view [1/s]: with a smaller gain a velocity error carries it out
_STANDS_M_S = 1e-3
_HALVINGS = 12  # of a second or so: to a millisecond
_ASIDE_M_S = 0.3  # along the gap, while it crosses: as much as the limit of speed leaves


@dataclass(frozen=True, slots=True)
class Passage:
    """A straight way from a view into the next one.

    It leaves the first view and reaches the next one at distances [m] from its begin, along a unit vector (2); share:
    the part of the velocity that goes that way.
    """

    leaves_m: float
    reaches_m: float
    way: Array
    share: float

    @property
    def gap_m(self) -> float:
        """Return the length of the way on which the robot is unseen [m]."""
        return max(0.0, self.reaches_m - self.leaves_m)


def view_around(place: Array, views: Sequence[Rectangle]) -> Rectangle | None:
    """Return the view in which a place (2) [m] lies deepest, outside of all the nearest one; None without views."""
    return max(views, key=lambda view: view.depth_m(*place.tolist()), default=None)


def is_inside(place: Array, views: Sequence[Rectangle]) -> bool:
    """Return whether a place (2) [m] lies in a view."""
    return any(view.depth_m(*place.tolist()) >= 0.0 for view in views)


def passage(place: Array, velocity: Array, views: Sequence[Rectangle]) -> Passage | None:
    """Return the passage from the view about a place (2) [m] into the next one along a velocity (2); None if none.

    If the way misses all other views, that along the larger component of the velocity counts, else the smaller one.
    """
    home = view_around(place, views)
    if home is None or home.depth_m(*place.tolist()) < 0.0:
        return None
    others = [view for view in views if view is not home]
    ways = (velocity, *sorted(np.diag(velocity), key=np.linalg.norm, reverse=True))
    speed = max(math.hypot(*velocity), _STANDS_M_S)
    found = (_passage(place, way, home, others, speed) for way in ways if math.hypot(*way) > _STANDS_M_S)
    return next((one for one in found if one is not None), None)


def _passage(
    place: Array, velocity: Array, home: Rectangle, others: Sequence[Rectangle], speed: float
) -> Passage | None:
    size = math.hypot(*velocity)
    way = velocity / size
    (x, y), (ahead, aside) = place.tolist(), way.tolist()
    _, leaves_m = home.span((x, y), (ahead, aside))
    spans = (view.span((x, y), (ahead, aside)) for view in others)
    reached = [first for first, last in spans if first <= last and last > leaves_m]
    return Passage(leaves_m, max(0.0, min(reached)), way, size / speed) if reached else None


def gap_about_m(place: Array, views: Sequence[Rectangle]) -> float:
    """Return the distances [m] from a place (2) between two views to both of them, added; infinite with fewer views."""
    ways = sorted(math.dist(place, view.nearest(*place.tolist())) for view in views)
    return ways[0] + ways[1] if len(ways) > 1 else math.inf


def unseen_way_m(leaves_m: float, speed: float, most: float, follows_s: float, unseen_s: float) -> float:
    """Return how far [m] a vehicle gets beyond a border in `unseen_s` after it has passed it.

    The border is `leaves_m` ahead. The vehicle has a speed [m/s] now, a setpoint at its maximum `most` [m/s], and a
    lag `follows_s`.
    """
    lacks = max(0.0, most - speed)
    low, high = 0.0, follows_s + leaves_m / max(most, _STANDS_M_S)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        way_m = most * middle - lacks * follows_s * -math.expm1(-middle / follows_s)
        low, high = (middle, high) if way_m < leaves_m else (low, middle)
    lacks *= math.exp(-high / follows_s)
    return max(0.0, most * unseen_s - lacks * follows_s * -math.expm1(-unseen_s / follows_s))


def hold(view: Rectangle, place: Array, velocity: Array, most: float) -> Array:
    """Return the part of a velocity (2) [m/s] that keeps a robot in its view.

    place (2) [m]: its point of rest, because a lagging vehicle held by its present place leaves the view. Outside of
    the view it flies back at up to `most` [m/s].
    """
    low, high = (HOLD_GAIN * (side - place) for side in np.transpose((view.x_m, view.y_m)))
    return np.asarray(np.clip(velocity, np.minimum(low, most), np.maximum(high, -most)))


def into(view: Rectangle, place: Array, velocity: Array, most: float) -> Array:
    """Return the velocity (2) [m/s] with which a robot outside a view flies straight into it.

    Inwards it flies at the wanted speed, or faster, up to `most`; along the border it moves little.
    """
    low, high = (np.array(side) for side in np.transpose((view.x_m, view.y_m)))
    inner = view.shrunk(_INSET_M)
    near = np.array(inner.nearest(*place.tolist()))
    straight, below, above = np.clip(_GAIN * (near - place), -most, most), place < low, place > high
    straight = np.where(below, np.maximum(straight, velocity), np.minimum(straight, velocity))
    along = np.clip(np.clip(velocity, -_ASIDE_M_S, _ASIDE_M_S), low - place, high - place)
    return np.asarray(np.where(below | above, straight, along))

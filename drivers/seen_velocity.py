"""A vehicle's velocity as cameras see it, independent of its reports. Pure."""

import math
from collections import deque
from collections.abc import Sequence

from drivers.seen_place import MOST_STD_M, last_seen
from groundstation.bus.messages import EntityEstimate
from groundstation.time_units import NS_PER_MS, NS_PER_S

_WINDOW_NS = 600 * NS_PER_MS
_LEAST_WINDOW_NS = 450 * NS_PER_MS
_SEEN_AGE_S = 0.5
# A faster change is no flight: the belief was set anew.
_LEAP_M_S = 4.0
_FRESH_NS = 300 * NS_PER_MS


def _place_ns(now_ns: int, entity: EntityEstimate) -> int | None:
    """Return the time at which a vehicle was where the estimate has it; None if that place is too uncertain."""
    worst = max(entity.covariance[0], entity.covariance[5]) if len(entity.covariance) == 16 else math.inf
    if entity.age_s <= _SEEN_AGE_S and worst <= MOST_STD_M**2:
        return now_ns
    seen = last_seen(now_ns, entity)
    return None if seen is None else seen[0]


class SeenVelocity:
    """Velocity and climb of a vehicle from positions that cameras correct, over half a second; None while unseen."""

    def __init__(self) -> None:
        self._places: deque[tuple[int, float, float, float]] = deque()
        self._heights: deque[tuple[int, float]] = deque()
        self._epoch: int | None = None
        self._heard_ns = 0

    def take(self, now_ns: int, epoch: int, entity: EntityEstimate) -> None:
        """Take the tracker's estimate of the vehicle."""
        at_ns = _place_ns(now_ns, entity) if entity.converged and len(entity.mean) >= 4 else None
        if at_ns is None or epoch != self._epoch:
            self._places.clear()
            self._heights.clear()
            self._epoch = epoch
        if at_ns is None:
            return
        self._heard_ns = now_ns
        x, y, z, yaw = entity.mean[:4]
        if self._places:
            then_ns, then_x, then_y, _ = self._places[-1]
            if at_ns <= then_ns:
                return  # still the same picture
            if math.hypot(x - then_x, y - then_y) > 0.1 + _LEAP_M_S * (at_ns - then_ns) / NS_PER_S:
                self._places.clear()
        self._places.append((at_ns, x, y, yaw))
        while at_ns - self._places[0][0] > _WINDOW_NS:
            self._places.popleft()
        self._take_height(at_ns, z, entity.covariance)

    def _take_height(self, at_ns: int, z_m: float, covariance: Sequence[float]) -> None:
        """Take a height if it is known as well as a place has to be."""
        if len(covariance) != 16 or covariance[10] > MOST_STD_M**2:
            self._heights.clear()
            return
        if self._heights:
            then_ns, then_m = self._heights[-1]
            if abs(z_m - then_m) > 0.1 + _LEAP_M_S * (at_ns - then_ns) / NS_PER_S:
                self._heights.clear()
        self._heights.append((at_ns, z_m))
        while at_ns - self._heights[0][0] > _WINDOW_NS:
            self._heights.popleft()

    def velocity(self, now_ns: int) -> tuple[float, float] | None:
        """Return the mean velocity of the last half second, forward and left in its middle [m/s], or None."""
        if not self._places or now_ns - self._heard_ns > _FRESH_NS:
            return None
        (before_ns, x0, y0, _), (last_ns, x1, y1, _) = self._places[0], self._places[-1]
        if last_ns - before_ns < _LEAST_WINDOW_NS:
            return None
        elapsed_s = (last_ns - before_ns) / NS_PER_S
        vx, vy = (x1 - x0) / elapsed_s, (y1 - y0) / elapsed_s
        yaw = self._places[len(self._places) // 2][3]  # a mean over the window, during which the vehicle may turn
        c, s = math.cos(yaw), math.sin(yaw)
        return c * vx + s * vy, c * vy - s * vx

    def climb(self, now_ns: int) -> float | None:
        """Return the mean climb of the last half second [m/s], or None."""
        if not self._heights or now_ns - self._heard_ns > _FRESH_NS:
            return None
        (before_ns, before_m), (last_ns, last_m) = self._heights[0], self._heights[-1]
        if last_ns - before_ns < _LEAST_WINDOW_NS:
            return None
        return (last_m - before_m) * NS_PER_S / (last_ns - before_ns)

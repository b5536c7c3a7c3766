"""How fast a vehicle is by what cameras see, whatever it reports. Pure."""

import math
from collections import deque

from groundstation.bus.messages import EntityEstimate
from groundstation.time_units import NS_PER_MS, NS_PER_S

_WINDOW_NS = 600 * NS_PER_MS
_LEAST_WINDOW_NS = 450 * NS_PER_MS
_SEEN_AGE_S = 0.5
# Two places known to 0.1 m tell a speed to 0.28 m/s, and the first sighting after a while moves the belief by as much.
_MOST_VARIANCE_M2 = 0.05**2
# Faster than this is no flight: the belief was set anew.
_LEAP_M_S = 4.0
_FRESH_NS = 300 * NS_PER_MS


class SeenVelocity:
    """Velocity of a vehicle by the positions that cameras correct, over half a second; reports nothing while unseen."""

    def __init__(self) -> None:
        self._places: deque[tuple[int, float, float, float]] = deque()
        self._epoch: int | None = None

    def hear(self, now_ns: int, epoch: int, entity: EntityEstimate) -> None:
        """Take the tracker's estimate of the vehicle."""
        worst = max(entity.covariance[0], entity.covariance[5]) if len(entity.covariance) == 16 else math.inf
        good = entity.converged and entity.age_s <= _SEEN_AGE_S and worst <= _MOST_VARIANCE_M2
        if not good or epoch != self._epoch:
            self._places.clear()
            self._epoch = epoch
        if not good:
            return
        x, y, _, yaw = entity.mean[:4]
        if self._places:
            then_ns, then_x, then_y, _ = self._places[-1]
            if math.hypot(x - then_x, y - then_y) > 0.1 + _LEAP_M_S * (now_ns - then_ns) / NS_PER_S:
                self._places.clear()
        self._places.append((now_ns, x, y, yaw))
        while now_ns - self._places[0][0] > _WINDOW_NS:
            self._places.popleft()

    def velocity(self, now_ns: int) -> tuple[float, float] | None:
        """Return the mean velocity of the last half second, forward and left in its middle [m/s], or None."""
        if not self._places or now_ns - self._places[-1][0] > _FRESH_NS:
            return None
        (before_ns, x0, y0, _), (last_ns, x1, y1, _) = self._places[0], self._places[-1]
        if last_ns - before_ns < _LEAST_WINDOW_NS:
            return None
        elapsed_s = (last_ns - before_ns) / NS_PER_S
        vx, vy = (x1 - x0) / elapsed_s, (y1 - y0) / elapsed_s
        yaw = self._places[len(self._places) // 2][3]  # a mean over the window, during which the vehicle may turn
        c, s = math.cos(yaw), math.sin(yaw)
        return c * vx + s * vy, c * vy - s * vx

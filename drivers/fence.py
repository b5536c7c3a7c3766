"""Whether a flying vehicle has left the field's fence, by the tracker's estimate of it. Pure.

The bottom is not judged: every flight begins and ends there.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from groundstation.bus.messages import EntityEstimate
from groundstation.time_units import NS_PER_MS
from groundstation.vectors import Bounds

# Beyond the fence by so much more than this many deviations it is outside, until it is back within the second figure.
_SIGMAS = 2.0
_LEAVES_M, _BACK_M = 0.1, 0.05
# It is on its way back at this speed, or half of what it may fly: a tracker brings its vehicles back at 0.2 m/s, or as
# fast as they may.
_RETURNS_M_S, _RETURNS_SHARE = 0.1, 0.5
_FRESH_NS = 300 * NS_PER_MS


class _Side(NamedTuple):
    """A side of the fence: how far the estimate is beyond it, surely so, and whether it is on its way back [m]."""

    beyond_m: float
    surely_m: float
    returns: bool
    where: str


class FenceWatch:
    """Call `hear` with each estimate of the vehicle. fence_m: low and high along x, y, z [world]; None: there is none.

    max_speed_m_s, max_climb_m_s: as fast as it may fly. An estimate that sightings contradict, or that is old, tells
    nothing.
    """

    def __init__(
        self, fence_m: Bounds | None, max_speed_m_s: float = math.inf, max_climb_m_s: float = math.inf
    ) -> None:
        self._fence_m = fence_m
        limits = (max_speed_m_s, max_speed_m_s, max_climb_m_s)
        self._returns_m_s = [min(_RETURNS_M_S, _RETURNS_SHARE * limit) for limit in limits]
        self._heard_ns: int | None = None
        self._left: dict[int, _Side] = {}

    def hear(self, now_ns: int, entity: EntityEstimate) -> None:
        """Take the tracker's estimate."""
        if self._fence_m is None or len(entity.covariance) != 16 or len(entity.velocity_m_s) < 3 or entity.contradicted:
            return
        sides = enumerate(_sides(self._fence_m, entity, self._returns_m_s))
        before, self._heard_ns = self._left, now_ns
        self._left = {
            which: side
            for which, side in sides
            if side.surely_m > _LEAVES_M or (which in before and side.beyond_m > _BACK_M)
        }

    def outside(self, now_ns: int, returning_counts: bool) -> str:
        """Return how far it is outside, in words, or ""; returning_counts: even while it is on its way back."""
        if self._heard_ns is None or now_ns - self._heard_ns > _FRESH_NS:
            return ""
        left = (side for side in self._left.values() if returning_counts or not side.returns)
        worst = max(left, key=lambda side: side.beyond_m, default=None)
        return "" if worst is None else f"it is {worst.beyond_m:.1f} m {worst.where}"


def _sides(fence_m: Bounds, entity: EntityEstimate, returns_m_s: Sequence[float]) -> list[_Side]:
    sides = []
    for axis, (low, high) in enumerate(fence_m):
        place, velocity, enough = entity.mean[axis], entity.velocity_m_s[axis], returns_m_s[axis]
        doubt_m = _SIGMAS * math.sqrt(max(0.0, entity.covariance[5 * axis]))
        where = "above the fence" if axis == 2 else "outside the fence"
        sides.append(_Side(place - high, place - high - doubt_m, -velocity >= enough, where))
        if axis != 2:
            sides.append(_Side(low - place, low - place - doubt_m, velocity >= enough, where))
    return sides

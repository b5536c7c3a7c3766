"""Whether a flying vehicle comes down to the floor, by the tracker's estimate of it. Pure.

A vehicle notices its landing a second or two after it touched the floor; until then its controllers work against the
floor, and it would shoot off if it were made to fly on.
"""

import math

from groundstation.bus.messages import EntityEstimate

# A hand's breadth.
_NEAR_M = 0.1
# A drone that was not seen for long may be anywhere: only so much of its uncertainty counts.
_SIGMAS, _MOST_M = 2.0, 0.2
# It sinks on until it is caught, as any vehicle comes to rest.
_LAG_S, _BRAKES_M_S2 = 0.3, 2.0


class TouchDown:
    """Call `hear` with each estimate of the vehicle and `of_flight` once a turn.

    Without newer estimates the last one counts: near the floor no camera may see it.
    """

    def __init__(self) -> None:
        self._risen = self._near = self._low = False

    def hear(self, entity: EntityEstimate) -> None:
        """Take the tracker's estimate, localised or not."""
        if len(entity.mean) < 4 or len(entity.velocity_m_s) < 3 or len(entity.covariance) != 16:
            return
        std_m = math.sqrt(max(0.0, entity.covariance[10]))
        least_m = entity.mean[2] - min(_SIGMAS * std_m, _MOST_M)
        self._risen = self._risen or least_m > _NEAR_M
        self._low = entity.mean[2] <= _NEAR_M and _SIGMAS * std_m <= _MOST_M
        sinks_m_s = max(0.0, -entity.velocity_m_s[2])
        self._near = least_m - _LAG_S * sinks_m_s - sinks_m_s**2 / (2 * _BRAKES_M_S2) <= _NEAR_M

    def of_flight(self, aloft: bool) -> bool:
        """Return whether it touches down: it has risen since its take-off, and is, or soon will be, near the floor."""
        self._risen = self._risen and aloft
        return self._risen and self._near

    @property
    def low(self) -> bool:
        """Return whether it is near the floor already, by an estimate that knows its height."""
        return self._risen and self._low

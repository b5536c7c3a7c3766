"""Detects, packet by packet, an AR.Drone whose optical flow has lost the floor. Pure.

What it reports then is unmeasured. It may say so; or its velocity drops to nearly nothing faster than it can brake, and
stays there.
"""

import math
from collections import deque

from groundstation.time_units import NS_PER_MS, NS_PER_S

NO_MOTION_M_S = 0.15
"""A reported speed below this may be that of a drone which sees nothing of its motion."""

# Means of this many packets are compared, so that noise of 3 cm/s makes no step.
_MEAN_OF = 3
# The greatest tilt, 12 degrees, brakes by 2 m/s^2, and the largest step of such means of noise is 0.1 m/s.
_STEP_M_S, _BRAKES_M_S2 = 0.15, 2.1
# A drone that has stopped wanders off again within this time, if a glitch was all.
_STAYS_NS = 150 * NS_PER_MS
_LONGEST_GAP_NS = 300 * NS_PER_MS
# For how long a drone must report that it sees no floor, and for how long after its last such packet that counts.
_SAYS_NS, _HOLD_NS = 200 * NS_PER_MS, NS_PER_S


class FlowWatch:
    """State of one drone's optical flow in the air.

    suspected: its velocity stopped as no drone can, and is no measurement unless it moves soon; lost: it sees no floor,
    either by its own word, until a second after that ends, or by such a stop, until `reset`.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin anew, for a drone that does not fly."""
        self._recent: deque[tuple[int, float, float]] = deque(maxlen=2 * _MEAN_OF)
        self._stopped_ns: int | None = None
        self._says_since_ns: int | None = None
        self._said_ns: int | None = None
        self._stays = False
        self.suspected = self.lost = False

    def update(self, stamp_ns: int, velocity_m_s: tuple[float, float], says_no_vision: bool) -> None:
        """Take the horizontal velocity of one packet [m/s], and whether the drone says that it has no vision."""
        self._recent.append((stamp_ns, *velocity_m_s))
        self._hear(stamp_ns, says_no_vision)
        if self._stopped_ns is not None or math.hypot(*velocity_m_s) < NO_MOTION_M_S:
            self._compare(stamp_ns)
        said = self._said_ns is not None and stamp_ns - self._said_ns < _HOLD_NS
        self.suspected, self.lost = self._stopped_ns is not None, self._stays or said

    def _hear(self, stamp_ns: int, says_no_vision: bool) -> None:
        if not says_no_vision:
            self._says_since_ns = None
            return
        self._says_since_ns = stamp_ns if self._says_since_ns is None else self._says_since_ns
        if stamp_ns - self._says_since_ns >= _SAYS_NS:
            self._said_ns = stamp_ns

    def _compare(self, stamp_ns: int) -> None:
        """Look for a stop in the last packets, and whether it lasts."""
        if len(self._recent) < 2 * _MEAN_OF or self._stays:
            return
        packets = list(self._recent)
        (before_ns, *before), (now_ns, *now) = _mean(packets[:_MEAN_OF]), _mean(packets[_MEAN_OF:])
        if math.hypot(*now) >= NO_MOTION_M_S:
            self._stopped_ns = None
        elif self._stopped_ns is not None:
            self._stays = stamp_ns - self._stopped_ns >= _STAYS_NS
        elif now_ns - before_ns < _LONGEST_GAP_NS:
            step_m_s = math.dist(before, now)
            if step_m_s > _STEP_M_S + _BRAKES_M_S2 * (now_ns - before_ns) / NS_PER_S:
                self._stopped_ns = stamp_ns


def _mean(packets: list[tuple[int, float, float]]) -> tuple[float, float, float]:
    stamps, forward, left = zip(*packets, strict=True)
    count = len(packets)
    return sum(stamps) / count, sum(forward) / count, sum(left) / count

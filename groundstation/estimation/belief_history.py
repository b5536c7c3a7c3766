"""The beliefs of the last second, for pictures that arrive later than the belief of their time."""

from collections import deque

from groundstation.estimation.belief import JointBelief
from groundstation.time_units import NS_PER_S

KEPT_NS = NS_PER_S
"""The largest age of a picture, at any rate of beliefs."""


class BeliefHistory:
    """Keeps the newest beliefs, in the order of their stamps."""

    def __init__(self) -> None:
        self._beliefs: deque[JointBelief] = deque()

    def append(self, belief: JointBelief) -> None:
        """Add the newest belief."""
        self._beliefs.append(belief)
        while belief.stamp_ns - self._beliefs[0].stamp_ns >= KEPT_NS:
            self._beliefs.popleft()

    def at(self, stamp_ns: int) -> JointBelief | None:
        """Return the kept belief nearest to a time [ns], or None."""
        if not self._beliefs or not self._beliefs[0].stamp_ns <= stamp_ns <= self._beliefs[-1].stamp_ns:
            return None
        return min(self._beliefs, key=lambda one: abs(one.stamp_ns - stamp_ns))

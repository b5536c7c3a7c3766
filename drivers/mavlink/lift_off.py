"""Whether a vehicle that says that it flies has left the floor yet. Pure.

WIRE (docs/reference/mavlink.md 2.1): PX4 says that it is in the air up to 3.5 s before it leaves the floor. Until it
does, no camera's word counts and its pad is fed: its estimator would coast through the lift-off on nothing.
"""

from drivers.mavlink.wire.names import Landed

# An estimator that is told that it stands on its pad shows little of its height, and its climb sooner.
_RISEN_M, _CLIMBING_M_S, _CLIMBING_NS = 0.1, 0.1, 300_000_000


class LiftOff:
    """lifted: it is off the floor. A vehicle that was not asked to take off flies when it says so."""

    def __init__(self) -> None:
        self.lifted = False
        self._floor_m: float | None = None
        self._climbing_since_ns: int | None = None

    def hear(self, now_ns: int, starting: bool, landed: int, height_m: float, climb_m_s: float) -> float:
        """Take its own words, and whether it was asked to take off; return its height above the floor [m]."""
        if landed == Landed.ON_GROUND or self._floor_m is None:
            self._floor_m = height_m
        risen_m = height_m - self._floor_m
        if landed == Landed.ON_GROUND:
            self.lifted, self._climbing_since_ns = False, None
            return risen_m
        if climb_m_s < _CLIMBING_M_S:
            self._climbing_since_ns = None
        elif self._climbing_since_ns is None:
            self._climbing_since_ns = now_ns
        climbs = self._climbing_since_ns is not None and now_ns - self._climbing_since_ns >= _CLIMBING_NS
        self.lifted = self.lifted or not starting or climbs or risen_m >= _RISEN_M
        return risen_m

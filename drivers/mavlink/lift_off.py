"""Judges whether a vehicle that reports flight has left the floor, where it stood, and how far its reports count. Pure.

WIRE (docs/reference/mavlink.md 2.1): PX4 reports flight up to 3.5 s before it leaves the floor. The height that cameras
see decides. The vehicle's reports count where cameras do not see it, or if they exceed their largest error.
"""

from drivers.mavlink.wire.names import Landed
from groundstation.bus.messages import Vector3
from groundstation.time_units import NS_PER_MS, NS_PER_S

# An estimator that is sent the pad's position shows little of its height, and its climb sooner.
_RISEN_M, _CLIMBING_M_S, _CLIMBING_NS = 0.1, 0.1, 300 * NS_PER_MS
# Three times the error of a height seen by cameras.
_SEEN_RISEN_M = 0.1
# While cameras see it, its own report alone counts only beyond a height by which it is never wrong on the floor.
_SEEN_NS, _SURELY_RISEN_M = 500 * NS_PER_MS, 0.4
_STANDING = 25  # number of estimates whose mean is the place where it stands
# EXTENDED_SYS_STATE is requested five times a second, and anew after 3 s without it (`session.py`).
_OLD_NS = 6 * NS_PER_S


def credible(landed: int, age_ns: int, motors_flew: bool) -> int:
    """Return the MAV_LANDED_STATE to act upon, given the reported one and its age; UNDEFINED if that is too old.

    motors_flew: it has lifted off, and its motors turn. ON_GROUND then counts as landing, until it disarms: its
    detector may err, and a vehicle in the air must not be taken for a standing one.
    """
    if age_ns > _OLD_NS:
        return Landed.UNDEFINED
    return Landed.LANDING if motors_flew and landed == Landed.ON_GROUND else landed


class LiftOff:
    """Finds the moment of lift-off; without a take-off command a vehicle has lifted when it reports so.

    lifted: it is off the floor; stood: mean of its first places by the tracker, where it stood [world], None if there
    were none.
    """

    def __init__(self) -> None:
        self.lifted = False
        self.stood: Vector3 | None = None
        self._places = 0
        self._seen_ns: int | None = None
        self._floor_m: float | None = None
        self._climbing_since_ns: int | None = None

    def see(self, now_ns: int, place: Vector3, age_s: float) -> None:
        """Take its place by the tracker [world] while it has not lifted; age_s: time since its last sighting."""
        if age_s * NS_PER_S < _SEEN_NS:
            self._seen_ns = now_ns
        stood = self.stood or place
        if self._places < _STANDING:
            self._places += 1
            x, y, z = (old + (new - old) / self._places for old, new in zip(stood, place, strict=True))
            stood = (x, y, z)
        self.stood = stood
        self.lifted = self.lifted or place[2] - stood[2] >= _SEEN_RISEN_M

    def take(self, now_ns: int, starting: bool, landed: int, height_m: float, climb_m_s: float) -> float:
        """Take its reports, and whether it was ordered to take off; return its height above the floor by them [m]."""
        if landed == Landed.ON_GROUND or self._floor_m is None:
            self._floor_m = height_m
        risen_m = height_m - self._floor_m
        if landed == Landed.ON_GROUND:
            self.lifted, self._climbing_since_ns = False, None
            if not starting:
                self.stood, self._places = None, 0
            return risen_m
        if climb_m_s < _CLIMBING_M_S:
            self._climbing_since_ns = None
        elif self._climbing_since_ns is None:
            self._climbing_since_ns = now_ns
        climbs = self._climbing_since_ns is not None and now_ns - self._climbing_since_ns >= _CLIMBING_NS
        stood = self._places == _STANDING  # else cameras have only seen it rise
        if stood and self._seen_ns is not None and now_ns - self._seen_ns < _SEEN_NS:
            says = risen_m >= _SURELY_RISEN_M  # its climb rate errs by 0.15 m/s for seconds where it stands
        else:
            says = climbs or risen_m >= _RISEN_M
        self.lifted = self.lifted or not starting or says
        return risen_m

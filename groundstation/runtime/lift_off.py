"""Checks that the drone that reports flight is the one whose marker rose. Pure.

Reports are assigned to a drone by address, sightings by marker. If the two disagree, the addresses or the markers of
two drones are exchanged, and the tracker would steer one drone by sightings of the other.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from groundstation.runtime.team import Member
from groundstation.time_units import NS_PER_S

# Ten times the error of a fixed camera's heights (2 to 3 cm at 4 m), and less than the lowest take-off height (0.4 m).
RISEN_M = 0.25
# Tolerance between the two heights. A height is reported 0.1 s before the sighting arrives, at climbs of up to 1 m/s;
# the edge of a pad or a cable below the drone takes off 0.2 m; lenses are calibrated to 2 %. An AR.Drone hovers at 0.8
# m: a marker on the floor is off by twice the tolerance. An autopilot's height is a barometer's or our own belief sent
# back, and is never published (drivers/mavlink/publisher.py): of those vehicles only the rise counts.
AGREES_M = 0.4
# A vehicle whose estimator is sent another one's height climbs without end, at up to 1 m/s in the simulator.
_OTHER_ROSE_NS = NS_PER_S // 2
_NOTHING_ROSE_NS = 3 * NS_PER_S
# A vehicle that reports no height may report flight as soon as its skids are free: PX4 took 2 s from there to RISEN_M
# in the simulator, and its limits may make it climb more slowly.
_NOTHING_ROSE_YET_NS = 5 * NS_PER_S
_REMEDY = (
    "check address, system id and marker code of {} in the field file against what the drones are and carry "
    "(groundstation vehicle blink shows which of them answers to which name)"
)


@dataclass(frozen=True, slots=True)
class Mistake:
    """A likely mistake in the field file or in the placing of markers, and what to check."""

    text: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.text}; {self.remedy}"


def is_seen_in_flight(member: Member, now_ns: int) -> bool:
    """Return whether a camera sees the marker of a flying drone as high as the drone reports."""
    rise_m, reported_m = member.rise_m(now_ns), member.reported_m(now_ns)
    if not member.up or rise_m is None or rise_m < RISEN_M:
        return False
    return reported_m is None or abs(rise_m - reported_m) <= AGREES_M


def why_unseen(member: Member, now_ns: int, for_s: float) -> str:
    """Return why a flying drone was not seen in flight for a time [s]."""
    rise_m, reported_m = member.rise_m(now_ns), member.reported_m(now_ns)
    if rise_m is None:
        return f"it flies, but no fixed camera has seen it for {for_s:g} s"
    reports = "flies" if reported_m is None else f"reports {reported_m:.1f} m"
    return f"it {reports}, but its marker rose by {rise_m:.1f} m"


class LiftOffWatch:
    """Watches one take-off for a marker that stays on the floor while its drone flies."""

    def __init__(self) -> None:
        self._since: dict[str, int] = {}

    def step(self, now_ns: int, name: str, members: Mapping[str, Member]) -> Mistake | None:
        """Return the likely mistake if the named drone flies and its marker does not."""
        member = members[name]
        if not _has_lifted(member, now_ns) or _has_risen(member, now_ns):
            self._since.clear()
            return None
        risen = [n for n, other in members.items() if n != name and other.standing and _has_risen(other, now_ns)]
        on_floor = member.rise_m(now_ns) is not None
        says = _says(name, member, now_ns)
        if self._lasted("other", bool(risen), now_ns) >= _OTHER_ROSE_NS:
            own = "is on the floor" if on_floor else "is out of view"
            both = f"{name} and {risen[0]}"
            text = f"{says} but its marker {own} and {risen[0]}'s marker rose: the addresses or markers of the two are"
            return Mistake(f"{text} probably exchanged", _REMEDY.format(both))
        patience_ns = _NOTHING_ROSE_YET_NS if member.reported_m(now_ns) is None else _NOTHING_ROSE_NS
        if self._lasted("none", on_floor and not risen, now_ns) >= patience_ns:
            text = f"{says} but its marker is on the floor and no other rose: its address or marker is probably"
            return Mistake(f"{text} that of another drone", _REMEDY.format(name))
        return None

    def _lasted(self, what: str, condition: bool, now_ns: int) -> int:
        if not condition:
            self._since.pop(what, None)
            return 0
        return now_ns - self._since.setdefault(what, now_ns)


def _has_risen(member: Member, now_ns: int) -> bool:
    rise_m = member.rise_m(now_ns)
    return rise_m is not None and rise_m >= RISEN_M


def _has_lifted(member: Member, now_ns: int) -> bool:
    reported_m = member.reported_m(now_ns)
    return member.lifting and (member.up if reported_m is None else reported_m >= RISEN_M)


def _says(name: str, member: Member, now_ns: int) -> str:
    reported_m = member.reported_m(now_ns)
    return f"{name} says that it flies" if reported_m is None else f"{name} reports {reported_m:.1f} m"

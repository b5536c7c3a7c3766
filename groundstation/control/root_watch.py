"""Time since a sensor fixed in the room last located each robot, and whether any such sensor still works. Pure."""

import math
from collections.abc import Collection, Iterable

from groundstation.bus.messages import (
    BodyPoses,
    Message,
    RangeObservation,
    RelativeObservation,
    SearchedPicture,
    Severity,
    Verdict,
)
from groundstation.bus.notice import Notice
from groundstation.estimation.measurement import Correction
from groundstation.time_units import NS_PER_MS, NS_PER_S

_USED = (Verdict.ACCEPTED, Verdict.INFLATED)
# Longer than the silence of a camera with 2 pictures a second, or of one that is restarted; for a sensor whose data are
# refused, no longer than two of its pictures take.
_SILENT_NS, _HANGS_NS = 1_500 * NS_PER_MS, 500 * NS_PER_MS
_SILENCE = "no fixed camera or sensor tells anything new: drones hover, then land"
_REMEDY = "check power and cable of what is fixed in the room; the team goes on when that sees it"


class RootWatch:
    """Call `hear` with each message that counts and `advance` once a tick; ask `age_s` and `is_silent`.

    roots: sensors that are fixed in the room; carried: robots and targets, which pass on their place when one sees
    another. Two that see only each other drift together, and nothing in their sightings shows it. links: the filter's
    names for the parts of ranging systems, one for each anchor and robot.
    """

    def __init__(self, roots: Collection[str], carried: Iterable[str], links: Collection[str] = ()) -> None:
        self._roots, self._carried = frozenset(roots), frozenset(carried)
        self._placing = self._roots | frozenset(links)
        # For each entity: the entities from which a root's sighting reached it, and when a root last saw each of them.
        self._rooted_ns: dict[str, dict[str, int]] = {}
        self._heard_ns: dict[str, int] = {}
        self._telling: set[str] = set()
        self._hanging: set[str] = set()
        self._ages_s: dict[str, float] = {}
        self._now_ns = 0
        self._told = False
        self._silent: bool | None = None

    @property
    def is_silent(self) -> bool:
        """Return whether no root has sent new data for 1.5 s, or 0.5 s if all data that it still sends are refused.

        A root that never reports empty pictures may just have no robot in view; it is judged only while it repeats
        itself.
        """
        if self._silent is None:
            self._silent = bool(self._roots) and all(map(self._says_nothing, self._roots))
        return self._silent

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message that was not refused."""
        self._silent = None
        match message:
            case SearchedPicture() if message.observer in self._roots:
                self._note(message.observer, now_ns, works=not message.found)
            case BodyPoses() if message.header.entity in self._roots:
                refused = bool(message.bodies) and len(message.refused) == len(message.bodies)
                self._note(message.header.entity, now_ns, works=not refused)
                if refused:
                    self._hanging.add(message.header.entity)
            case RelativeObservation() | RangeObservation() if message.observer in self._roots:
                self._renew(message.observer, now_ns)

    def hear_frozen(self, message: Message) -> None:
        """Take a message that was refused because its sensor hangs; new sightings of the same picture come with it."""
        if isinstance(message, RelativeObservation | RangeObservation) and message.observer in self._roots:
            self._hanging.add(message.observer)
            self._silent = None

    def advance(
        self,
        now_ns: int,
        corrections: Iterable[Correction],
        ranged: Iterable[tuple[str, str, bool]] = (),
        *,
        flying: bool,
    ) -> list[Notice]:
        """Take what the filter used since the last call; returns the notices for the operator.

        ranged: (observer, subject, whether again) of robots that one round of ranges placed: no correction tells it.
        """
        self._now_ns = now_ns
        self._ages_s.clear()
        self._silent = None
        for one in corrections:
            if one.verdict in _USED and one.subject in self._carried:
                self._tie(one, now_ns - round(one.latency_ms * NS_PER_MS))
        for _, placed, _ in ranged:
            self._rooted_ns.setdefault(placed, {})[placed] = now_ns
        told, self._told = self._told, self.is_silent and flying
        return [Notice(Severity.ERROR, _SILENCE, _REMEDY)] if self._told and not told else []

    def age_s(self, name: str) -> float:
        """Return the age [s] of a root's newest sighting that reached an entity, directly or not; or infinity."""
        if name not in self._ages_s:
            self._ages_s[name] = self._since_s(max(self._rooted_ns.get(name, {}).values(), default=None))
        return self._ages_s[name]

    def helped_age_s(self, name: str) -> float:
        """Return the age [s] of the newest that reached it through others: these count where no root sees it."""
        others = (at_ns for seen, at_ns in self._rooted_ns.get(name, {}).items() if seen != name)
        return self._since_s(max(others, default=None))

    def _since_s(self, at_ns: int | None) -> float:
        return math.inf if at_ns is None else (self._now_ns - at_ns) / NS_PER_S

    def _note(self, root: str, now_ns: int, *, works: bool) -> None:
        """Take a report of a root that also reports empty pictures; after its first report it counts as working."""
        self._telling.add(root)
        if works or root not in self._heard_ns:
            self._renew(root, now_ns)

    def _renew(self, root: str, now_ns: int) -> None:
        self._heard_ns[root] = now_ns
        self._hanging.discard(root)

    def _says_nothing(self, root: str) -> bool:
        if root not in self._hanging | self._telling:
            return False
        limit_ns = _HANGS_NS if root in self._hanging else _SILENT_NS
        return self._now_ns - self._heard_ns.get(root, self._now_ns) > limit_ns

    def _tie(self, one: Correction, at_ns: int) -> None:
        """Give both ends of a sighting the newest roots that either of them has."""
        if one.observer in self._placing:
            own = self._rooted_ns.setdefault(one.subject, {})
            own[one.subject] = max(at_ns, own.get(one.subject, at_ns))
            return
        ends = [self._rooted_ns.setdefault(name, {}) for name in (one.observer, one.subject)]
        for seen in ends[0].keys() | ends[1].keys():
            newest = max(end[seen] for end in ends if seen in end)
            for end in ends:
                end[seen] = newest

"""Warns the operator of entities that contradict the belief for seconds on end; no action follows.

The filter inflates observations beyond the gate and re-initialises entities that diverged. A contradiction that lasts
all the same has a cause that it cannot mend: a camera that was knocked, a wrong setting, a sensor or stream that hangs.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from groundstation.bus.messages import Message, Odometry, RelativeObservation, Severity, Verdict
from groundstation.bus.notice import Notice
from groundstation.estimation.measurement import Correction
from groundstation.time_units import NS_PER_S

# NIS per degree of freedom is 1 where the belief is right. A warning begins above the first value and ends below the
# second, each held for this long.
_FAR, _NEAR, _LASTING_NS = 4.0, 2.0, 3 * NS_PER_S
# One sighting counts no more than this: a single wild one is no lasting contradiction.
_MOST = 12.0
_FORGETTING_S, _SILENT_NS = 2.0, 2 * NS_PER_S
_LEAST_SIGHTINGS = 10.0
_FROZEN_NS = NS_PER_S

_SENSOR_REMEDY = "check how its camera is mounted, its calibration and its video_delay_ms (groundstation calibrate)"
_SUBJECT_REMEDY = (
    "check its marker and its odometry settings, and the cameras that see it; hold or land it if it strays"
)
_FROZEN_REMEDY = "it counts for nothing until it moves on; restart its stream or its driver, or land what depends on it"


@dataclass(slots=True)
class _Edge:
    """Forgetting sums of one observer's sightings of one subject, and the last time."""

    total: float = 0.0
    count: float = 0.0
    at_ns: int = 0

    def take(self, surprise: float, now_ns: int) -> None:
        kept = 0.5 ** ((now_ns - self.at_ns) / (_FORGETTING_S * 1e9)) if self.at_ns else 0.0
        self.total, self.count, self.at_ns = kept * self.total + surprise, kept * self.count + 1.0, now_ns

    @property
    def mean(self) -> float:
        return self.total / self.count


@dataclass(slots=True)
class _Alarm:
    """One entity: whether a warning stands, and since when the evidence has been against it."""

    raised: bool = False
    since_ns: int | None = None

    def changes(self, wanted: bool, after_ns: int, now_ns: int) -> bool:
        """Return whether the state changes now: once the other one has been wanted for long enough."""
        if wanted == self.raised:
            self.since_ns = None
            return False
        self.since_ns = now_ns if self.since_ns is None else self.since_ns
        if now_ns - self.since_ns < after_ns:
            return False
        self.raised, self.since_ns = wanted, None
        return True


class ConsistencyWatch:
    """Call `take` with corrections, `refused` with refused messages, and `notices` once a tick or less often."""

    def __init__(self, names: Collection[str]) -> None:
        self._edges: dict[tuple[str, str], _Edge] = {}
        self._alarms = {name: _Alarm() for name in names}
        self._frozen = {name: _Alarm() for name in names}
        self._froze_at: dict[tuple[str, str], int] = {}

    def refused(self, message: Message, verdict: Verdict, now_ns: int) -> None:
        """Take a refused message; a message that repeats itself shows that its sensor hangs."""
        if verdict is Verdict.FROZEN and message.header.entity in self._frozen:
            kind = {RelativeObservation: "camera", Odometry: "odometry"}.get(type(message), "sensor")
            self._froze_at[message.header.entity, kind] = now_ns

    def take(self, corrections: Iterable[Correction], now_ns: int) -> None:
        """Take corrections; one that initialised its subject is no evidence on the belief before."""
        for c in corrections:
            if c.nis is not None and c.residual and not c.joined and {c.observer, c.subject} <= self._alarms.keys():
                edge = self._edges.setdefault((c.observer, c.subject), _Edge())
                edge.take(min(c.nis / len(c.residual), _MOST), now_ns)

    def notices(self, now_ns: int, cause: str = "") -> list[Notice]:
        """Return new and ended warnings; cause: the explanation of contradictions, if known."""
        return self._contradictions(now_ns, cause) + self._freezes(now_ns)

    def _contradictions(self, now_ns: int, cause: str) -> list[Notice]:
        live = {
            pair: edge.mean
            for pair, edge in self._edges.items()
            if now_ns - edge.at_ns <= _SILENT_NS and edge.count >= _LEAST_SIGHTINGS
        }
        blamed = _blamed(live)
        found = []
        for name, alarm in self._alarms.items():
            own = [mean for pair, mean in live.items() if name in pair]
            if not own:
                alarm.since_ns = None  # an entity that is not seen gives no evidence, for or against
                continue
            wanted = name in blamed if not alarm.raised else max(own) > _NEAR
            if not alarm.changes(wanted, _LASTING_NS, now_ns):
                continue
            if not alarm.raised:
                found.append(Notice(Severity.INFO, "sightings agree with the belief again", entity=name))
                continue
            pairs = sorted(blamed[name])
            found.append(_warning(name, pairs, max(live[pair] for pair in pairs), cause))
        return found

    def _freezes(self, now_ns: int) -> list[Notice]:
        found = []
        for name, alarm in self._frozen.items():
            kinds = [k for (who, k), at_ns in self._froze_at.items() if who == name and now_ns - at_ns <= _FROZEN_NS]
            if not alarm.changes(bool(kinds), 0, now_ns):
                continue
            if alarm.raised:
                text = f"its {' and '.join(sorted(kinds))} repeats itself: refused as frozen"
                found.append(Notice(Severity.WARNING, text, _FROZEN_REMEDY, name))
            else:
                found.append(Notice(Severity.INFO, "no longer frozen", entity=name))
        return found


def _blamed(live: Mapping[tuple[str, str], float]) -> dict[str, list[tuple[str, str]]]:
    """Return the pairs whose mean contradicts the belief, by the entity to blame."""
    far = {pair for pair, mean in live.items() if mean > _FAR}
    blamed: dict[str, list[tuple[str, str]]] = {}
    for pair in far:
        blamed.setdefault(_culprit(pair, far, live), []).append(pair)
    return blamed


def _culprit(pair: tuple[str, str], far: Collection[tuple[str, str]], live: Collection[tuple[str, str]]) -> str:
    """Return the entity to blame for a contradicting pair: the observer if it contradicts alone, or elsewhere as well.

    If all observers of a subject contradict its estimate, the subject is named: the culprit cannot be determined.
    """
    observer, subject = pair
    rivals = [other for other in live if other[1] == subject and other[0] != observer]
    elsewhere = [other for other in live if other[0] == observer and other[1] != subject]
    if elsewhere and all(other in far for other in elsewhere):
        return observer
    if rivals and not any(other in far for other in rivals):
        return observer
    return subject


def _warning(name: str, pairs: list[tuple[str, str]], worst: float, cause: str) -> Notice:
    if all(observer == name for observer, _ in pairs):
        what, remedy = f"what its camera sees of {', '.join(subject for _, subject in pairs)}", _SENSOR_REMEDY
    else:
        sees = "see" if len(pairs) > 1 else "sees"
        what, remedy = f"what {' and '.join(observer for observer, _ in pairs)} {sees} of it", _SUBJECT_REMEDY
    if cause:
        remedy = f"probably not its fault: {cause}"
    lasting = f"{_LASTING_NS // 10**9} s: NIS {worst:.0f} per degree of freedom, not 1"
    return Notice(Severity.WARNING, f"{what} contradicts the belief for {lasting}", remedy, name)

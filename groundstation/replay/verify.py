"""Re-runs a recording and compares the tracker's messages with the recorded ones, to the bit."""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from groundstation.bus import codec
from groundstation.bus.messages import Estimate, Message
from groundstation.bus.topics import ESTIMATE
from groundstation.errors import MessageError
from groundstation.field.resolved import ResolvedField
from groundstation.recording.reader import RawRecord
from groundstation.replay.difference import MessageDifference, first_difference
from groundstation.replay.rerun import Rerun, Words
from groundstation.replay.source import Source
from groundstation.replay.tick_log import OUTPUTS, Tape, Tick
from groundstation.runtime.tracker_loop import EPOCHS_PER_LIFE
from groundstation.time_units import NS_PER_S

_KEPT_DIFFERENCES = 200
# A plan is stamped with its begin; one begun shortly before the end may never have been adopted.
_PLANNING_NS = NS_PER_S
# Journal and messages reach the recorder one after the other.
_ENDED_NS = NS_PER_S
_NAMES = frozenset(topic.name for topic in OUTPUTS)


@dataclass(frozen=True, slots=True)
class RerunFinding:
    """A difference and its place in the run: tick of the tracker's life, seconds since the recording began."""

    tick: int
    time_s: float
    topic: str
    entity: str
    difference: MessageDifference

    def __str__(self) -> str:
        return f"tick {self.tick}, {self.time_s:.2f} s: {self.topic} {self.entity} {self.difference}"


@dataclass(slots=True)
class Lived:
    """One tick of a re-run: its time [s since the recording began], and its messages."""

    tick: Tick
    time_s: float
    said: Words


@dataclass(slots=True)
class Comparison:
    """The result of a re-run.

    same, unrecorded: messages by topic that were identical, or missing in the recording; fragments: lives of the
    tracker without their begin in the journal, or whose end it lacks, which cannot be repeated exactly; missing:
    inputs in the journal that the recording lacks; differing: number of differing messages, the first ones in
    `findings`.
    """

    ticks: int = 0
    lives: int = 0
    plans: int = 0
    recorded_s: float = 0.0
    cpu_s: float = 0.0
    same: Counter[str] = field(default_factory=Counter)
    unrecorded: Counter[str] = field(default_factory=Counter)
    fragments: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    missing_count: int = 0
    differing: int = 0
    findings: list[RerunFinding] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)

    @property
    def identical(self) -> bool:
        """Return whether every recorded message of the tracker was repeated, and there were any."""
        return not (self.differing or self.fragments or self.missing_count) and bool(self.same)

    @property
    def speed(self) -> float:
        """Return recorded seconds per second of CPU."""
        return self.recorded_s / self.cpu_s if self.cpu_s > 0 else 0.0


class Repetition:
    """Re-runs a recording, tick by tick, and compares; `comparison` is complete after the last tick.

    hear: called with every present message, encoded.
    """

    def __init__(
        self, source: Source, resolved: ResolvedField, hear: Callable[[bytes], object] = lambda _said: None
    ) -> None:
        self._hear = hear
        self.comparison = Comparison()
        self.tape = Tape(source.state)
        self._source = source
        self._resolved = resolved
        self._began_ns = source.began_ns
        self._life: Rerun | None = None

    def ticks(self) -> Iterator[Lived]:
        """Yield every tick with its present messages."""
        comparison = self.comparison
        began_s, first_ns, last_ns = time.process_time(), 0, 0
        for tick in self.tape.ticks():
            first_ns, last_ns = first_ns or tick.at_ns, tick.at_ns
            self._note_inputs(tick)
            if tick.first or self._life is None:
                self._life = self._new_life(tick)
            said = self._life.tick(tick)
            for _, message in said:
                self._hear(codec.encode(message))
            comparison.ticks += 1
            comparison.plans += tick.entry.plan_tick >= 0
            lived = Lived(tick, (tick.at_ns - self._began_ns) / 1e9, said)
            self._compare(lived)
            yield lived
        self._find_unsaid(first_ns, last_ns)
        comparison.recorded_s = (last_ns - first_ns) / 1e9
        comparison.cpu_s = time.process_time() - began_s
        comparison.damage = [*self._source.damage, *self.tape.damage]

    def _new_life(self, tick: Tick) -> Rerun:
        comparison, entry = self.comparison, tick.entry
        comparison.lives += 1
        if entry.tick != 0:
            at_s = (tick.at_ns - self._began_ns) / 1e9
            comparison.fragments.append(
                f"the journal begins, or goes on after a gap, at tick {entry.tick} ({at_s:.2f} s)"
            )
        site = self._source.run.get("site", "lab")
        return Rerun(self._resolved, site, entry, self._epoch(tick))

    def _epoch(self, tick: Tick) -> int:
        """Return the number of the tracker's life: from its first estimate, else from the recorder's settings."""
        records = self.tape.said.get((ESTIMATE.name, "team", tick.at_ns))
        first = _decoded(records[0]) if records else None
        if isinstance(first, Estimate):
            return first.epoch // EPOCHS_PER_LIFE
        text = self._source.run.get("epoch", "0")
        return int(text) if text.isdigit() else 0

    def _note_inputs(self, tick: Tick) -> None:
        self.comparison.missing_count += len(tick.missing)
        for key, seq in tick.missing[: max(0, 20 - len(self.comparison.missing))]:
            self.comparison.missing.append(f"tick {tick.entry.tick}: {key} number {seq}")

    def _compare(self, lived: Lived) -> None:
        """Compare present messages with recorded ones, group by group in the order of sending."""
        groups: dict[tuple[str, str, int], list[Message]] = {}
        for topic, message in lived.said:
            if topic.name in _NAMES:
                stamp_ns = message.header.stamp_ns + self._source.unix_offset_ns
                groups.setdefault((topic.name, message.header.entity, stamp_ns), []).append(message)
        for place, messages in groups.items():
            records = self.tape.said.pop(place, [])
            self._compare_group(lived, place[0], place[1], messages, records)

    def _compare_group(
        self, lived: Lived, topic: str, entity: str, messages: list[Message], records: list[RawRecord]
    ) -> None:
        records.sort(key=lambda record: record.sequence)
        recorded = [message for record in records if (message := _decoded(record)) is not None]
        lost = max(0, len(messages) - len(recorded))  # on their way to the recorder, at any place of the group
        for message in messages:
            difference = first_difference(recorded[0], message) if recorded else None
            if not recorded or (difference and lost):
                lost -= 1
                self.comparison.unrecorded[topic] += 1
                continue
            recorded.pop(0)
            if difference:
                self._found(lived, topic, entity, difference)
            else:
                self.comparison.same[topic] += 1
        for extra in recorded:
            self._found(lived, topic, entity, MessageDifference("message", type(extra).__name__, None))

    def _found(self, lived: Lived, topic: str, entity: str, difference: MessageDifference) -> None:
        self._note_finding(RerunFinding(lived.tick.entry.tick, lived.time_s, topic, entity, difference))

    def _note_finding(self, finding: RerunFinding) -> None:
        self.comparison.differing += 1
        if len(self.comparison.findings) < _KEPT_DIFFERENCES:
            self.comparison.findings.append(finding)

    def _find_unsaid(self, first_ns: int, last_ns: int) -> None:
        """Count recorded messages of a finished tick that were not sent now as differences too.

        Those of a time that the journal no longer tells of were not compared at all.
        """
        untold_s = [(stamp_ns - last_ns) / 1e9 for _, _, stamp_ns in self.tape.said if stamp_ns > last_ns + _ENDED_NS]
        if last_ns and untold_s:
            ended_s = (last_ns - self._began_ns) / 1e9
            text = f"the journal ends at {ended_s:.2f} s, {max(untold_s):.1f} s before the tracker's last message"
            self.comparison.fragments.append(text)
        for (topic, entity, stamp_ns), records in sorted(self.tape.said.items(), key=lambda item: item[0][2]):
            if not first_ns <= stamp_ns <= last_ns - _PLANNING_NS:
                continue
            difference = MessageDifference("message", f"{len(records)} recorded", None)
            self._note_finding(RerunFinding(-1, (stamp_ns - self._began_ns) / 1e9, topic, entity, difference))


def _decoded(record: RawRecord) -> Message | None:
    try:
        return codec.decode(record.key, record.data)
    except MessageError:
        return None

"""A recording tick by tick of the tracker, with its inputs and its messages."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from groundstation.bus import codec
from groundstation.bus.messages import JournalEntry, Message
from groundstation.bus.topics import BELIEF, ESTIMATE, INNOVATION, JOURNAL, PLAN, SETPOINT
from groundstation.errors import MessageError
from groundstation.recording.chunks import among
from groundstation.recording.reader import RawRecord, open_recording
from groundstation.runtime.inbox import TOPICS as INPUTS
from groundstation.time_units import NS_PER_MS, NS_PER_S

OUTPUTS = (ESTIMATE, BELIEF, PLAN, SETPOINT, INNOVATION)
# Senders reach the recorder in no fixed order; after this much recorded time a tick is complete.
_PATIENCE_NS = 1_500 * NS_PER_MS
_FORGET_NS = 20 * NS_PER_S
_TIDY_EVERY = 500

Name = tuple[str, int]
Said = tuple[str, str, int]


@dataclass(slots=True)
class Tick:
    """One tick of the journal; `first`: a life of the tracker, or its remaining part, begins here.

    inputs: its recorded inputs; missing: (key, seq) of the rest; at_ns: UNIX time.
    """

    entry: JournalEntry
    at_ns: int
    first: bool = False
    inputs: list[tuple[str, Message]] = field(default_factory=list)
    missing: list[Name] = field(default_factory=list)


class Tape:
    """Reads the files of a run once, in order, holding a few seconds at a time.

    `said` collects the tracker's messages, by (topic, entity, publish time), until they are taken.
    """

    def __init__(self, files: Iterable[Path]) -> None:
        self._files = tuple(files)
        self._held: defaultdict[Name, list[RawRecord]] = defaultdict(list)
        self._former: JournalEntry | None = None
        self.said: defaultdict[Said, list[RawRecord]] = defaultdict(list)
        self.damage: list[str] = []
        self.inputs = 0

    def ticks(self) -> Iterator[Tick]:
        """Yield the ticks of all lives of the tracker, in order."""
        waiting: list[Tick] = []
        done = newest_ns = 0
        for record in self._records():
            if record.key.topic == JOURNAL:
                waiting += self._tick(record)
                newest_ns = record.publish_time_ns
            elif record.key.topic in INPUTS:
                self.inputs += 1
                self._held[str(record.key), record.sequence].append(record)
            else:
                self.said[record.key.topic.name, record.key.entity, record.publish_time_ns].append(record)
            # By the tracker's own time: an input may be stamped seconds ahead.
            while waiting and newest_ns > waiting[0].at_ns + _PATIENCE_NS:
                tick = waiting.pop(0)
                done += 1
                if done % _TIDY_EVERY == 0:
                    self._tidy(tick.at_ns)
                yield self._filled(tick)
        yield from map(self._filled, waiting)

    def _records(self) -> Iterator[RawRecord]:
        wanted = among((*INPUTS, *OUTPUTS, JOURNAL))
        for path in self._files:
            recording = open_recording(path)
            yield from recording.raw_records(wanted)
            self.damage += [f"{path.name}: {damage}" for damage in recording.damage]

    def _tick(self, record: RawRecord) -> list[Tick]:
        entry = self._decoded(record)
        if not isinstance(entry, JournalEntry):
            return []
        former, self._former = self._former, entry
        first = former is None or entry.tick != former.tick + 1 or entry.header.source != former.header.source
        return [Tick(entry, record.publish_time_ns, first)]

    def _filled(self, tick: Tick) -> Tick:
        for key, seq in tick.entry.ingested:
            candidates = self._held.get((key, seq & 0xFFFF_FFFF), [])
            # A restarted driver counts from zero again: the message nearest in time is the right one.
            candidates.sort(key=lambda record: abs(record.log_time_ns - tick.at_ns))
            message = self._decoded(candidates.pop(0)) if candidates else None
            if message is None:
                tick.missing.append((key, seq))
            else:
                tick.inputs.append((key, message))
        return tick

    def _decoded(self, record: RawRecord) -> Message | None:
        try:
            return codec.decode(record.key, record.data)
        except MessageError as error:
            self.damage.append(str(error))
            return None

    def _tidy(self, now_ns: int) -> None:
        """Drop unused messages: those that came while no tracker lived."""
        old = [n for n, held in self._held.items() if not held or held[-1].log_time_ns < now_ns - _FORGET_NS]
        for name in old:
            del self._held[name]

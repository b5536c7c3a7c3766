"""Iterates a recording in arrival order from any time; also the last message of each key before it.

A message is recorded at its time of measurement, but arrived later. The recorder wrote in order of arrival: earlier
messages in the file had arrived before, so its arrival is the latest time of any message so far.
"""

import heapq
from bisect import bisect_left
from collections import OrderedDict
from collections.abc import Iterator
from itertools import accumulate

from groundstation.bus.topics import COMMAND, COMMAND_ACK, ESTIMATE, EVENT
from groundstation.console.server import TOPICS
from groundstation.recording.chunks import RawRecord, Wanted, among
from groundstation.recording.index import FileIndex
from groundstation.recording.run import RecordedRun
from groundstation.replay.source import Source
from groundstation.time_units import NS_PER_S

Arrival = tuple[int, RawRecord]
_MILESTONES = (EVENT, COMMAND, COMMAND_ACK)
# This many small chunks hold the two minutes that a seek looks back over; those with pictures are large.
_KEPT_SMALL, _KEPT_LARGE = 1000, 6
_LARGE_BYTES = 200_000
_STEP_REACH_NS = 30 * NS_PER_S


is_shown = among(TOPICS)  # topics that the console shows


class _File:
    """One file's chunks by time of arrival [UNIX ns]."""

    def __init__(self, index: FileIndex) -> None:
        self._index = index
        self.ends = list(accumulate((chunk.end_ns for chunk in index.chunks), max))
        self.begins = [chunk.start_ns for chunk in index.chunks[:1]] + self.ends[:-1]
        # Estimates come 50 times a second and give the time well enough; a file of pictures needs its datagrams for it.
        known = {key.topic for key in index.channels.values() if key is not None}
        self._timed: Wanted = is_shown if ESTIMATE in known else lambda _topic: True
        self._read: OrderedDict[int, list[Arrival]] = OrderedDict()

    def between(self, after_ns: int, until_ns: int, wanted: Wanted) -> Iterator[Arrival]:
        for number in range(bisect_left(self.ends, after_ns + 1), len(self.ends)):
            if self.begins[number] > until_ns:
                return
            if not self._index.holds(self._index.chunks[number], wanted):
                continue
            for at_ns, record in self._arrivals(number):
                if after_ns < at_ns <= until_ns and wanted(record.key.topic):
                    yield at_ns, record

    def _arrivals(self, number: int) -> list[Arrival]:
        if number in self._read:
            self._read.move_to_end(number)
            return self._read[number]
        chunk = self._index.chunks[number]
        now_ns = self.begins[number]
        arrivals = []
        for record in self._index.read(chunk, self._timed):
            now_ns = max(now_ns, record.log_time_ns)
            if is_shown(record.key.topic):
                arrivals.append((now_ns, record))
        self._read[number] = arrivals
        while len(self._read) > (_KEPT_SMALL if chunk.length < _LARGE_BYTES else _KEPT_LARGE):
            self._read.popitem(last=False)
        return arrivals


class Reel:
    """All files of a run as one stream of arrivals; times in UNIX ns."""

    def __init__(self, source: Source) -> None:
        self._source_damage = source.damage
        self._run = RecordedRun([*source.state, *source.raw])
        self._files = [_File(index) for index in self._run.indexes if index.chunks]
        self.start_ns = min((file.begins[0] for file in self._files), default=0)
        self.end_ns = max((file.ends[-1] for file in self._files), default=0)
        self.topics = frozenset(key.topic.name for key in self._run.counts())
        self.milestones = list(self.between(self.start_ns - 1, self.end_ns, among(_MILESTONES)))

    @property
    def duration_s(self) -> float:
        """Return its length [s]."""
        return (self.end_ns - self.start_ns) / 1e9

    @property
    def damage(self) -> list[str]:
        """Return the faults of the files."""
        return [*self._source_damage, *self._run.damage]

    def between(self, after_ns: int, until_ns: int, wanted: Wanted = is_shown) -> Iterator[Arrival]:
        """Yield the messages that arrived after one time and not after another, in order of arrival."""
        streams = [file.between(after_ns, until_ns, wanted) for file in self._files]
        yield from heapq.merge(*streams, key=lambda arrival: arrival[0])

    def newest(self, at_ns: int, wanted: Wanted) -> list[RawRecord]:
        """Return the last message of each wanted key until a time."""
        return list(self._run.latest_before(at_ns + 1, wanted).values())

    def tick_after(self, at_ns: int) -> int:
        """Return the time of the next tick of the tracker, or of the end."""
        ticks = self.between(at_ns, min(at_ns + _STEP_REACH_NS, self.end_ns), among((ESTIMATE,)))
        return next((tick_ns for tick_ns, _ in ticks), self.end_ns)

    def tick_before(self, at_ns: int) -> int:
        """Return the time of the tracker's last tick before a time, or of the start."""
        for reach_ns in (_STEP_REACH_NS // 30, _STEP_REACH_NS):
            since_ns = max(self.start_ns - 1, at_ns - reach_ns)
            ticks = [tick_ns for tick_ns, _ in self.between(since_ns, at_ns - 1, among((ESTIMATE,)))]
            if ticks:
                return ticks[-1]
        return self.start_ns

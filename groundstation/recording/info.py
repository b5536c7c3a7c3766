"""Describes a recording: its parts, topics with counts and rates, versions, holes and damage."""

import json
from array import array
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mcap.opcode import Opcode

from groundstation.bus import keys
from groundstation.bus.topics import INNOVATION, OBSERVATION, PREFLIGHT, PROCESS_STATUS, SEARCH_MAP, SEARCHED_PICTURE
from groundstation.errors import MessageError
from groundstation.recording.chunks import inner_records, message_of
from groundstation.recording.index import FileIndex
from groundstation.recording.part_names import numbered_parts
from groundstation.recording.run import RecordedRun
from groundstation.recording.schemas import description_of
from groundstation.time_units import NS_PER_S

_RATED_S = 1.0  # messages over a shorter time have no rate
# A regular topic has a hole if it is silent for this long and for this many periods.
_HOLE_S = 1.0
_HOLE_PERIODS = 5.0
_MAX_HOLES = 20
# Published only while an entity is seen, searched for, or on the ground.
_NOW_AND_THEN = (OBSERVATION, INNOVATION, SEARCHED_PICTURE, SEARCH_MAP, PREFLIGHT)
_LATEST_NS = (1 << 63) - 1


@dataclass(frozen=True, slots=True)
class Hole:
    """A silence of one channel: from, to [s since the start]."""

    channel: str
    from_s: float
    to_s: float


@dataclass(frozen=True, slots=True)
class ChannelInfo:
    """One channel over all parts: schema, messages, mean rate [Hz], first and last message [s since the start].

    The rate is 0 if the messages span less than a second: two that came together have none.
    """

    channel: str
    schema: str
    messages: int
    rate_hz: float
    first_s: float
    last_s: float
    longest_gap_s: float


@dataclass(frozen=True, slots=True)
class PartInfo:
    """One file; `damage` is empty when it is whole."""

    path: str
    size_bytes: int
    messages: int
    damage: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RecordingInfo:
    """The whole description, ready to be printed or encoded."""

    parts: tuple[PartInfo, ...]
    start_unix_ns: int
    duration_s: float
    channels: tuple[ChannelInfo, ...]
    holes: tuple[Hole, ...]
    missing_parts: tuple[str, ...]
    changed_messages: tuple[str, ...]
    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, int]

    @property
    def whole(self) -> bool:
        """Return whether nothing is damaged or missing (a hole may be the flight's, not the recording's)."""
        return not self.missing_parts and not any(part.damage for part in self.parts)


@dataclass(slots=True)
class _Times:
    schema: str
    times: "array[int]" = field(default_factory=lambda: array("q"))


def info_of(run: RecordedRun) -> RecordingInfo:
    """Return the description of a run; every chunk is read and its checksum compared."""
    channels: dict[str, _Times] = {}
    counts = [_gather(index, channels) for index in run.indexes]
    regular = _regular(channels)
    listed = [_channel(name, held, run, name in regular) for name, held in sorted(channels.items())]
    return RecordingInfo(
        parts=(*_unread(run), *map(_part, run.indexes, counts)),
        start_unix_ns=run.start_ns,
        duration_s=run.duration_s,
        channels=tuple(info for info, _ in listed),
        holes=tuple(hole for _, holes in listed for hole in holes),
        missing_parts=tuple(_missing(run)),
        changed_messages=tuple(_changed(run)),
        metadata=run.metadata,
        attachments={name: len(data) for name, data in run.attachments.items()},
    )


def _unread(run: RecordedRun) -> list[PartInfo]:
    return [PartInfo(str(path), path.stat().st_size, 0, (text,)) for path, text in run.unread.items()]


def _part(index: FileIndex, messages: int) -> PartInfo:
    return PartInfo(str(index.path), index.path.stat().st_size, messages, tuple(index.damage))


def _gather(index: FileIndex, channels: dict[str, _Times]) -> int:
    """Add the log times of a file's messages by channel; return their number."""
    by_id: dict[int, array[int]] = {}
    for id_, channel in index.declared.items():
        schema = index.schemas.get(channel.schema_id)
        held = channels.setdefault(channel.topic, _Times(schema.name if schema else ""))
        by_id[id_] = held.times
    total = 0
    for chunk in index.chunks:
        data = index.data(chunk)
        for opcode, begin, end in inner_records(data, index.damage):
            if opcode == Opcode.MESSAGE:
                number, _, logged, _, _ = message_of(data, begin, end)
                if number in by_id:
                    by_id[number].append(min(logged, _LATEST_NS))
                    total += 1
    return total


def _channel(name: str, held: _Times, run: RecordedRun, is_regular: bool) -> tuple[ChannelInfo, list[Hole]]:
    times_s = (np.sort(np.frombuffer(held.times, dtype=np.int64)) - run.start_ns) / NS_PER_S
    if len(times_s) < 2:
        first_s = float(times_s[0]) if len(times_s) else 0.0
        return ChannelInfo(name, held.schema, len(times_s), 0.0, first_s, first_s, 0.0), []
    gaps_s = np.diff(times_s)
    first_s, last_s = float(times_s[0]), float(times_s[-1])
    rate_hz = (len(times_s) - 1) / (last_s - first_s) if last_s - first_s >= _RATED_S else 0.0
    found = ChannelInfo(name, held.schema, len(times_s), rate_hz, first_s, last_s, float(gaps_s.max()))
    limit_s = max(_HOLE_S, _HOLE_PERIODS * float(np.median(gaps_s)))
    after = np.flatnonzero(gaps_s > limit_s)[: _MAX_HOLES if is_regular else 0]
    return found, [Hole(name, float(times_s[n]), float(times_s[n + 1])) for n in after]


def _regular(channels: Iterable[str]) -> set[str]:
    """Return the channels whose silence is a hole.

    Missing observations of an unseen entity are no fault of a recording; nor is silence of a reporter of another
    process's state while that process reports itself.
    """
    parsed = {}
    for name in channels:
        with suppress(MessageError):
            parsed[name] = keys.parse(name)
    speaking = {key.entity for key in parsed.values() if key.topic is PROCESS_STATUS and key.entity == key.source}
    return {
        name
        for name, key in parsed.items()
        if key.topic.rate_hz > 0
        and key.topic not in _NOW_AND_THEN
        and not (key.topic is PROCESS_STATUS and key.entity != key.source and key.entity in speaking)
    }


def _missing(run: RecordedRun) -> list[str]:
    """Return the names of missing parts, which are known for whole folders only."""
    missing = []
    for folder, stem in sorted({(index.path.parent, index.stem) for index in run.indexes}):
        there = dict(numbered_parts(folder, stem))
        if len(there) > 1:
            names = (f"{stem}.mcap" if number == 1 else f"{stem}-{number}.mcap" for number in range(1, max(there)))
            missing += [name for name in names if not (folder / name).exists()]
    return missing


def _changed(run: RecordedRun) -> list[str]:
    """Return a line for each message type that has changed since the recording."""
    lines: dict[str, None] = {}
    for index in run.indexes:
        for id_, channel in index.declared.items():
            key, schema = index.channels.get(id_), index.schemas.get(channel.schema_id)
            if key is None or key.topic.type is None or schema is None:
                continue
            now = description_of(key.topic)
            if schema.data != now.schema:
                lines.setdefault(_difference(schema.name, _properties(schema.data), _properties(now.schema)))
    return list(lines)


def _properties(schema: bytes) -> set[str]:
    try:
        found: dict[str, Any] = json.loads(schema).get("properties", {})
    except (ValueError, AttributeError):
        return set()
    return set(found)


def _difference(name: str, then: set[str], now: set[str]) -> str:
    parts = [
        f"{sign} {', '.join(sorted(names))}" for sign, names in (("then", then - now), ("now", now - then)) if names
    ]
    return f"{name}: {'; '.join(parts) or 'differs in what its fields hold'}"

"""The parts of a run that count: from TRACK to the commands that end each flight of the team, else in the air."""

from collections.abc import Sequence

import numpy as np

from groundstation.arrays import Array, BoolArray
from groundstation.bus.messages import AckStage, Verb
from groundstation.report.aloft import in_the_air
from groundstation.report.tracks import RunData

_STARTED = (AckStage.ACCEPTED, AckStage.EFFECTIVE)
_ENDS, _STARTS = (Verb.LAND, Verb.CUT_MOTORS), (Verb.TAKEOFF, Verb.TRACK)

# A process reports itself once a second: a shorter flight has no figures of its own.
_LEAST_S = 3.0
_HOLE_S = 1.0

Span = tuple[float, float]


def tracking_spans(data: RunData) -> tuple[Span, ...]:
    """Return (start, end) [s] of each flight; none when no drone ever accepted TRACK.

    A flight ends once LAND or CUT_MOTORS was ordered to all of the team, at once or one by one, else with the last
    message.
    """
    spans = list[Span]()
    for start in sorted(_accepted(data)):
        if not spans or start > spans[-1][1]:
            spans.append((start, _end(data, start)))
    return tuple(spans)


def flight_spans(data: RunData) -> tuple[Span, ...]:
    """Return the parts of a run by which processes and planner are judged [s]: the time on the floor asks little.

    Where it tracked for less than 3 s, from the first take-off to the last landing; without these the whole run.
    """
    aloft = in_the_air(data)
    for spans in (tracking_spans(data), (aloft,) if aloft else ()):
        if sum(end - start for start, end in spans) >= _LEAST_S:
            return spans
    return ((-np.inf, np.inf),)


def within(time_s: Array, spans: Sequence[Span]) -> BoolArray:
    """Return for each time whether it is in one of some spans (n)."""
    found = np.zeros(len(time_s), dtype=bool)
    for start, end in spans:
        found |= (time_s >= start) & (time_s <= end)
    return found


def recorded_share(data: RunData) -> float | None:
    """Return the share of the flights of which anything is recorded; None without a flight, or if it is unknown.

    A second without a message of any process is a hole: in flight some come every few hundredths.
    """
    aloft = in_the_air(data)
    spans = tracking_spans(data) or ((aloft,) if aloft else ())
    total_s = sum(end - start for start, end in spans)
    if total_s <= 0.0 or not len(data.recorded_s):
        return None
    lost_s = 0.0
    for start, end in spans:
        silences = np.diff([start, *data.recorded_s[within(data.recorded_s, [(start, end)])], end])
        lost_s += float(silences[silences > _HOLE_S].sum())
    return 1.0 - lost_s / total_s


def tracking_interval(data: RunData) -> Span | None:
    """Return the begin of the first flight and the end of the last [s], or None without a flight."""
    return whole(tracking_spans(data))


def whole(spans: Sequence[Span]) -> Span | None:
    """Return the begin of the first span and the end of the last [s], or None without any."""
    return (spans[0][0], spans[-1][1]) if spans else None


def _accepted(data: RunData) -> list[float]:
    """Return when each TRACK was first accepted [s]: answers are repeated."""
    first = dict[str, float]()
    for ack in data.acks:
        if ack.message.verb is Verb.TRACK and ack.message.stage in _STARTED:
            before = first.get(ack.message.command_id, ack.time_s)
            first[ack.message.command_id] = min(before, ack.time_s)
    return list(first.values())


def _end(data: RunData, start: float) -> float:
    team, down = set(data.drones), set[str]()
    for command in data.commands:
        verb, scope = command.message.verb, set(command.message.scope or team)
        if command.time_s < start:
            continue
        if verb in _STARTS:
            down -= scope
        elif verb in _ENDS:
            down |= scope
            if down >= team:
                return command.time_s
    return max(start, data.end_s)

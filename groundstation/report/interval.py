"""The parts of a run that count: from TRACK until the team was ordered down or is on the floor, else in the air."""

from collections.abc import Iterator, Sequence

import numpy as np

from groundstation.arrays import Array, BoolArray
from groundstation.bus.messages import AckStage, Verb
from groundstation.report.aloft import Said, flights_of, held_at, in_the_air
from groundstation.report.tracks import RunData

_STARTED = (AckStage.ACCEPTED, AckStage.EFFECTIVE)
_TRACKS = "TRACK"  # the mode of a driver that obeys setpoints
_ENDS, _STARTS = (Verb.LAND, Verb.CUT_MOTORS), (Verb.TAKEOFF, Verb.TRACK)

# A process reports itself once a second: a shorter flight has no figures of its own.
_LEAST_S = 3.0
_HOLE_S = 1.0

Span = tuple[float, float]


def tracking_spans(data: RunData) -> tuple[Span, ...]:
    """Return (start, end) [s] of each flight; none when no drone ever accepted TRACK or was in that mode.

    A flight ends once each drone of the team was ordered LAND or CUT_MOTORS or is on the floor, however it got there;
    else with the last message.
    """
    spans = list[Span]()
    accepted = _accepted(data)
    for start in sorted([*accepted, *_shown(data, accepted)]):
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


def _shown(data: RunData, accepted: Sequence[float]) -> Iterator[float]:
    """Yield the times [s] when a drone was first seen in mode TRACK although nobody's answer to an order is recorded.

    A hole may hide all answers: they are repeated for a fifth of a second only, but the mode is reported throughout.
    """
    for reports in data.vehicles.values():
        # Reports that begin in mode TRACK do not tell when it began; they count only if no answer at all is recorded.
        before_s, mode = -np.inf, _TRACKS if accepted else ""
        for item in sorted(reports, key=lambda item: item.time_s):
            begins = item.message.mode == _TRACKS != mode
            if begins and not any(before_s <= at_s <= item.time_s for at_s in accepted):
                yield item.time_s
            before_s, mode = item.time_s, item.message.mode


def _end(data: RunData, start: float) -> float:
    """Return the end of a flight [s]; where no drone is known to have flown since its start, only orders end it."""
    team = data.drones or tuple(data.vehicles) or ("",)  # without a field; nor any drone: an order to all counts
    flights = [flights_of(data, name) for name in team]
    orders = [_orders_down(data, name, team, start) for name in team]
    times = np.unique(np.concatenate([[start], *(said_s for said_s, _ in (*flights, *orders))]))
    times = times[times >= start]
    aloft = np.array([held_at(said, times) for said in flights])
    ordered = np.array([held_at(said, times) for said in orders])
    flew = np.logical_or.accumulate(aloft.any(axis=0))
    down = ordered.all(axis=0) | (flew & (ordered | ~aloft).all(axis=0))
    return float(times[int(np.argmax(down))]) if down.any() else max(start, data.end_s)


def _orders_down(data: RunData, name: str, team: tuple[str, ...], start: float) -> Said:
    """Return when a drone was ordered down or up, from the start of a flight on [s], and whether down."""
    orders = [item for item in data.commands if item.time_s >= start and name in (item.message.scope or team)]
    said = sorted((one.time_s, one.message.verb in _ENDS) for one in orders if one.message.verb in (*_ENDS, *_STARTS))
    return np.array([at_s for at_s, _ in said]), np.array([down for _, down in said], dtype=bool)

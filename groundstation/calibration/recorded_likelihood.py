"""Re-runs the filter on a recorded flight with given delays, for the likelihood of its measurements.

No planner, no truth: only the tracker's inputs, tick by tick.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np

from groundstation.bus.messages import FlightState, JournalEntry, Message, RelativeObservation, VehicleStatus
from groundstation.calibration.flown import Flown
from groundstation.calibration.likeliest import Costs
from groundstation.errors import OperatorMistake
from groundstation.estimation.measurement import Correction
from groundstation.field.resolved import ResolvedField
from groundstation.replay.source import Source
from groundstation.replay.tick_log import Name, Tape
from groundstation.time_units import NS_PER_S
from groundstation.tracker import tracker_from_field

# Corrections are weighted by a Student distribution with this many degrees of freedom: outliers must not decide.
_FREEDOM = 8.0
_SETTLING_NS = 3 * NS_PER_S
_DOWN = frozenset({FlightState.LANDED, FlightState.UNKNOWN})
_SHOWN = 5


@dataclass(slots=True, eq=False)
class _Life:
    """A life of the tracker as far as it is recorded without gaps; missing: its inputs that are not recorded."""

    first: JournalEntry
    ticks: list[tuple[int, tuple[tuple[str, Message], ...]]] = field(default_factory=list)
    missing: list[Name] = field(default_factory=list)

    def statuses(self) -> Iterator[VehicleStatus]:
        return (message for _, inputs in self.ticks for _, message in inputs if isinstance(message, VehicleStatus))


def flown_of(source: Source) -> Flown:
    """Return the longest life of the tracker in a recording; raises OperatorMistake if it is empty."""
    lives: list[_Life] = []
    tape = Tape(source.state)
    for tick in tape.ticks():
        if tick.first or not lives:
            lives.append(_Life(tick.entry))
        lives[-1].ticks.append((tick.entry.now_ns, tuple(tick.inputs)))
        lives[-1].missing += tick.missing
    longest = max(lives, key=lambda life: len(life.ticks), default=None)
    flown = None if longest is None else Flown(tuple(longest.ticks), longest.first.header.clock)
    if longest is None or flown is None or not flown.cameras:
        raise OperatorMistake(
            f"{source.name}: no journal, or no observation of any camera is in it: nothing to measure"
        )
    doubts = (*_doubts(lives, longest), *source.damage, *tape.damage[:_SHOWN])
    return replace(flown, off_pads=_off_pads(lives, longest), doubts=doubts)


def _off_pads(lives: Sequence[_Life], used: _Life) -> frozenset[str]:
    """Return the drones that may have flown before this life; all, where its begin is not recorded."""
    if used.first.tick:
        return frozenset(status.header.entity for status in used.statuses())
    earlier = lives[: lives.index(used)]
    return frozenset(s.header.entity for life in earlier for s in life.statuses() if s.flight_state not in _DOWN)


def _doubts(lives: Sequence[_Life], used: _Life) -> Iterator[str]:
    if len(lives) > 1:
        part, ticks = lives.index(used) + 1, sum(len(life.ticks) for life in lives)
        yield (
            f"the tracker was restarted, or its journal has gaps: used is part {part} of {len(lives)}, "
            f"{len(used.ticks)} of {ticks} ticks"
        )
    if used.first.tick:
        yield f"the tracker's first {used.first.tick} ticks are not recorded: where the drones stood is not known"
    if used.missing:
        key, seq = used.missing[0]
        yield f"{len(used.missing)} messages that the tracker took in are not recorded: {key} number {seq}"


def costs(flown: Flown, resolved: ResolvedField, later_ms: Mapping[str, float]) -> Costs:
    """Return minus twice the log-likelihood of each observation of any observer, once the filter has settled.

    later_ms: delays of observers' pictures beyond their settings. One camera's sightings are predicted from those of
    all, so only the sum over all is the likelihood of a delay: one camera alone is predicted well even if its delay is
    attributed to the target.
    """
    shifts_ns = {name: round(later * 1e6) for name, later in later_ms.items()}
    tracker = tracker_from_field(resolved, flown.clock, 1)
    settled_ns = flown.ticks[0][0] + _SETTLING_NS
    found: dict[tuple[str, str, int], float] = {}
    for now_ns, inputs in flown.ticks:
        for key, message in inputs:
            tracker.ingest(key, _dated(message, shifts_ns), now_ns)
        tracker.advance(now_ns)
        tracker.take_notices()
        for c in tracker.take_corrections():
            if now_ns >= settled_ns and c.nis is not None:
                stamp_ns = now_ns - round(c.latency_ms * 1e6) + shifts_ns.get(c.observer, 0)
                found[c.observer, c.subject, stamp_ns] = _cost(c)
    return found


def _cost(correction: Correction) -> float:
    y = np.array(correction.residual)
    S = np.reshape(correction.covariance, (len(y), len(y)))
    square = float(y @ np.linalg.solve(S, y))
    return (_FREEDOM + len(y)) * math.log1p(square / _FREEDOM) + float(np.linalg.slogdet(S)[1])


def _dated(message: Message, shifts_ns: Mapping[str, int]) -> Message:
    if not isinstance(message, RelativeObservation) or not shifts_ns.get(message.observer):
        return message
    stamp_ns = message.header.stamp_ns - shifts_ns[message.observer]
    return msgspec.structs.replace(message, header=msgspec.structs.replace(message.header, stamp_ns=stamp_ns))

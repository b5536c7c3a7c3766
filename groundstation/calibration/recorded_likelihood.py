"""A recorded flight, lived again by today's filter under assumptions of choice: how likely does it find what was seen?

No planner, no truth: only what the tracker took in, tick by tick.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from groundstation.bus.messages import Message, RelativeObservation
from groundstation.errors import OperatorMistake
from groundstation.estimation.measurement import Correction
from groundstation.field.resolved import ResolvedField
from groundstation.replay.source import Source
from groundstation.replay.tick_log import Tape
from groundstation.tracker import tracker_from_field

# A correction counts like one of Student's distribution with so many degrees of freedom: outliers must not decide.
_FREEDOM = 8.0
_SETTLING_NS = 3_000_000_000
_LEAST_SEEN = 60

Change = Callable[[Message], Message]


@dataclass(frozen=True, slots=True)
class Flown:
    """What a tracker took in: (now [ns], its messages with their keys) by tick, and the clock it read."""

    ticks: tuple[tuple[int, tuple[tuple[str, Message], ...]], ...]
    clock: str
    cameras: dict[str, int]

    @property
    def duration_s(self) -> float:
        """Return how long it is."""
        return (self.ticks[-1][0] - self.ticks[0][0]) / 1e9


def flown_of(source: Source) -> Flown:
    """Return the longest life of the tracker in a recording; raises OperatorMistake when there is nothing in it."""
    lives: list[list[tuple[int, tuple[tuple[str, Message], ...]]]] = []
    clock = ""
    for tick in Tape(source.state).ticks():
        clock = tick.entry.header.clock
        if tick.first or not lives:
            lives.append([])
        lives[-1].append((tick.entry.now_ns, tuple(tick.inputs)))
    longest = max(lives, key=len, default=[])
    cameras: dict[str, int] = {}
    for _, inputs in longest:
        for _, message in inputs:
            if isinstance(message, RelativeObservation):
                cameras[message.camera] = cameras.get(message.camera, 0) + 1
    if not cameras:
        raise OperatorMistake(
            f"{source.name}: no journal, or no observation of any camera is in it: nothing to measure"
        )
    return Flown(tuple(longest), clock, cameras)


def corrections(flown: Flown, resolved: ResolvedField, change: Change = lambda message: message) -> list[Correction]:
    """Return what became of each observation once the filter has settled."""
    tracker = tracker_from_field(resolved, flown.clock, 1)
    settled_ns = flown.ticks[0][0] + _SETTLING_NS
    found: list[Correction] = []
    for now_ns, inputs in flown.ticks:
        for key, message in inputs:
            tracker.ingest(key, change(message), now_ns)
        tracker.advance(now_ns)
        done = tracker.take_corrections()
        tracker.take_notices()
        if now_ns >= settled_ns:
            found += done
    return found


class Surprise:
    """How badly the filter predicts what one observer sees, as chi-square: under any settings, dated in any way.

    Every observation is weighed as the filter with the recorded settings weighs such ones: a filter that knows less is
    not surprised either. `enough`: there is something to judge by.
    """

    def __init__(self, flown: Flown, resolved: ResolvedField, observer: str) -> None:
        self._flown, self._observer = flown, observer
        seen = [c for c in corrections(flown, resolved) if c.observer == observer and c.nis is not None]
        self.enough = len(seen) >= _LEAST_SEEN
        self._weights: dict[tuple[str, int], Any] = {}
        for kind in sorted({(c.subject, len(c.residual)) for c in seen}):
            mine = [np.reshape(c.covariance, (kind[1], kind[1])) for c in seen if (c.subject, len(c.residual)) == kind]
            self._weights[kind] = np.linalg.inv(np.median(mine, axis=0))

    def of(self, resolved: ResolvedField, change: Change = lambda message: message) -> float:
        """Return it for these settings and changed messages."""
        total = 0.0
        for c in corrections(self._flown, resolved, change):
            weight = self._weights.get((c.subject, len(c.residual))) if c.observer == self._observer else None
            if weight is not None:
                y = np.array(c.residual)
                total += (_FREEDOM + len(y)) * math.log1p(float(y @ weight @ y) / _FREEDOM)
        return total

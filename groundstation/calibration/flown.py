"""A recorded flight, lived again by today's filter under assumptions of choice: how likely does it find what was seen?

No planner, no truth: only what the tracker took in, tick by tick.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from groundstation.bus.messages import Message, RelativeObservation
from groundstation.errors import OperatorMistake
from groundstation.estimation.measurement import Correction
from groundstation.replay.source import Source
from groundstation.replay.ticks import Tape
from groundstation.tracker import tracker_from_field

# A correction counts like one of Student's distribution with so many degrees of freedom: outliers must not decide.
_FREEDOM = 8.0
_SETTLING_NS = 3_000_000_000

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


def cost(flown: Flown, resolved: Mapping[str, Any], change: Change = lambda message: message) -> float:
    """Return minus twice the logarithm of how likely all observations are; smaller is better.

    change: what is to be done to each message before the filter sees it.
    """
    total = 0.0
    for correction in corrections(flown, resolved, change):
        total += _surprise(correction)
    return total


def corrections(
    flown: Flown, resolved: Mapping[str, Any], change: Change = lambda message: message
) -> list[Correction]:
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


def _surprise(correction: Correction) -> float:
    if correction.nis is None or not correction.covariance:
        return 0.0
    rows = len(correction.residual)
    sign, volume = np.linalg.slogdet(np.reshape(correction.covariance, (rows, rows)))
    if sign <= 0:
        return 0.0
    return float(volume) + (_FREEDOM + rows) * math.log1p(correction.nis / _FREEDOM)

"""Re-runs the filter on a recorded flight with given delays, for the likelihood of its measurements.

No planner, no truth: only the tracker's inputs, tick by tick.
"""

import math
from collections.abc import Mapping

import msgspec
import numpy as np

from groundstation.bus.messages import Message, RelativeObservation
from groundstation.calibration.flown import Flown
from groundstation.calibration.likeliest import Costs
from groundstation.errors import OperatorMistake
from groundstation.estimation.measurement import Correction
from groundstation.field.resolved import ResolvedField
from groundstation.replay.source import Source
from groundstation.replay.tick_log import Tape
from groundstation.time_units import NS_PER_S
from groundstation.tracker import tracker_from_field

# Corrections are weighted by a Student distribution with this many degrees of freedom: outliers must not decide.
_FREEDOM = 8.0
_SETTLING_NS = 3 * NS_PER_S


def flown_of(source: Source) -> Flown:
    """Return the longest life of the tracker in a recording; raises OperatorMistake if it is empty."""
    lives: list[list[tuple[int, tuple[tuple[str, Message], ...]]]] = []
    clock = ""
    for tick in Tape(source.state).ticks():
        clock = tick.entry.header.clock
        if tick.first or not lives:
            lives.append([])
        lives[-1].append((tick.entry.now_ns, tuple(tick.inputs)))
    longest = max(lives, key=len, default=[])
    flown = Flown(tuple(longest), clock)
    if not flown.cameras:
        raise OperatorMistake(
            f"{source.name}: no journal, or no observation of any camera is in it: nothing to measure"
        )
    return flown


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

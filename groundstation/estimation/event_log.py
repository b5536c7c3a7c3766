"""Events in order of measurement time, in rows that the compiled filter reads."""

import math
from bisect import bisect_left, insort
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.messages import PoseHypothesis, Verdict
from groundstation.estimation import records as r
from groundstation.estimation.measurement import Correction, Measurement, SensorReading

FAR = "far beyond the gate"
# Reason of a sighting that would have re-initialised a belief if the same observer had not just done so for others.
HASTY = "far beyond the gate, but its observer lately had others given up"
# Reason of a sighting that is used without its heading.
TURNED = "its heading contradicts the vehicle's own: only its place counts"
OTHER_POSE = "the other pose hypothesis is more likely"
_VERDICTS = {
    r.ACCEPTED: (Verdict.ACCEPTED, ""),
    r.INFLATED: (Verdict.INFLATED, "beyond the gate"),
    r.IMPLAUSIBLE: (Verdict.IMPLAUSIBLE, FAR),
    r.OUT_OF_VIEW: (Verdict.OUT_OF_VIEW, "behind the camera"),
    r.SINGULAR: (Verdict.SINGULAR, "covariance is not positive definite"),
    r.OBSERVER_UNKNOWN: (Verdict.UNKNOWN_ENTITY, "the observer has no belief yet"),
    r.OBSERVER_UNCONFIRMED: (Verdict.UNKNOWN_ENTITY, "the observer was seen only once so far"),
    r.SUBJECT_GROUNDED: (Verdict.UNKNOWN_ENTITY, "the subject does not fly"),
    r.YAW_MISSING: (Verdict.AMBIGUOUS, "a robot joins only with a heading"),
    r.MISTAKEN: (Verdict.IMPLAUSIBLE, "far beyond the gate, but fits another entity: is its marker's id right?"),
    r.OBSERVER_HASTY: (Verdict.IMPLAUSIBLE, HASTY),
    r.TURNED: (Verdict.INFLATED, TURNED),
    r.OBSERVER_DOUBTED: (Verdict.IMPLAUSIBLE, "far beyond the gate, as is its observer itself"),
    r.CONTRADICTED: (Verdict.IMPLAUSIBLE, "it would join, but contradicts where its observer is: once is not enough"),
    r.NOT_LOCATED: (Verdict.AMBIGUOUS, "this sensor alone cannot place its subject"),
}
_EVENT, _OUTCOME = r.EventRow.packing(), r.OutcomeRow.packing()
_REST, _NOTHING = (0,) * (_EVENT.size // 8), bytes(_OUTCOME.size)
_IDENTITY = tuple(np.eye(4).ravel().tolist())


class EventLog:
    """A pool of event rows with their outcomes, listed by (time, tie-breaker) so that arrival order cannot matter."""

    def __init__(self, capacity: int = 256) -> None:
        self.events, self.outcomes = r.EventRow.rows(capacity), r.OutcomeRow.rows(capacity)
        self._free = list(range(capacity))
        self._order: list[tuple[int, str, int]] = []
        self._look()

    def add(self, stamp_ns: int, tie: str, values: Sequence[float]) -> int:
        """Insert an event from its first values (of `observation_values` or `change_values`); returns its row."""
        if not self._free:
            self._grow()
        row = self._free.pop()
        write_event(self._event_bytes, row, values)
        self._outcome_bytes[row * _OUTCOME.size : (row + 1) * _OUTCOME.size] = _NOTHING
        insort(self._order, (stamp_ns, tie, row))
        return row

    def rows_from(self, stamp_ns: int) -> NDArray[np.int64]:
        """Return the rows of all events at or after a time, in order."""
        first = bisect_left(self._order, (stamp_ns, "", -1))
        return np.array([row for _, _, row in self._order[first:]], dtype=np.int64)

    def forget_before(self, stamp_ns: int) -> None:
        """Free the rows of all events before a time."""
        count = bisect_left(self._order, (stamp_ns, "", -1))
        if count:
            self._free.extend(row for _, _, row in self._order[:count])
            del self._order[:count]

    def reached(self, rows: Iterable[int]) -> list[int]:
        """Return those of the events whose verdict is known."""
        verdicts = self._verdicts.tolist()
        return [row for row in rows if verdicts[row] != r.PENDING]

    def correction(self, row: int, observer: str, subject: str, latency_ms: float) -> Correction:
        """Return the outcome of an observation as a value."""
        verdict_code, size, nis, ahead_x, ahead_y, *values, alternative_chosen, joined = _OUTCOME.unpack_from(
            self._outcome_bytes, row * _OUTCOME.size
        )
        verdict, reason = _VERDICTS.get(verdict_code) or _unknown(verdict_code)
        if joined:
            reason = "joined" if size == 0 else "re-initialised: the belief contradicted several observations in a row"
        elif alternative_chosen:
            reason = (reason + "; " if reason else "") + OTHER_POSE
        if size == 0:
            return Correction(observer, subject, verdict, reason, latency_ms=latency_ms, joined=bool(joined))
        if not 0.0 <= nis < math.inf:
            return Correction(observer, subject, verdict, reason, latency_ms=latency_ms)
        residual, covariance = tuple(values[:size]), tuple(values[r.MAX_ROWS : r.MAX_ROWS + size * size])
        return Correction(
            observer, subject, verdict, reason, residual, covariance, nis, latency_ms, bool(joined), (ahead_x, ahead_y)
        )

    def _look(self) -> None:
        """Keep views of the tables as bytes, which Python reads and writes in half of numpy's time."""
        self._event_bytes = np.asarray(self.events).view(np.uint8).data
        self._outcome_bytes = np.asarray(self.outcomes).view(np.uint8).data
        self._verdicts = self.outcomes["verdict"]

    def _grow(self) -> None:
        size = len(self.events)
        events, outcomes = r.EventRow.rows(2 * size), r.OutcomeRow.rows(2 * size)
        np.asarray(events)[:size], np.asarray(outcomes)[:size] = self.events, self.outcomes
        self.events, self.outcomes = events, outcomes
        self._free.extend(range(size, 2 * size))
        self._look()


def _unknown(code: int) -> tuple[Verdict, str]:
    # A plug-in's sensor model may return any number: it costs its own readings, not the tracker.
    return Verdict.IMPLAUSIBLE, f"refused by its sensor model, whose prepare returned {-code}: no verdict"


def write_event(rows: memoryview, row: int, values: Sequence[float]) -> None:
    """Write an event's first values into its row of the table's bytes; the others become zero."""
    _EVENT.pack_into(rows, row * _EVENT.size, *values, *_REST[len(values) :])


def observation_values(
    m: Measurement | SensorReading, at: float, step: int, observer: int, subject: int, sensor: int,
    kind: int = r.OBSERVATION,
) -> list[float]:  # fmt: skip
    """Return the first values of an observation's EventRow; raises ValueError for a reading of the wrong shape."""
    if isinstance(m, Measurement):
        other, measured, rows = m.alternative, _pose(m), 3 if m.yaw_rad is None else 4
    else:
        other, measured, rows = None, _padded(m.z, m.covariance), len(m.z)
    has_other = 0 if other is None else 1
    values = [at, kind, observer, subject, sensor, step, rows, has_other, m.roll_rad, m.pitch_rad, *measured]
    return values if other is None else values + _pose(other)


def change_values(kind: int, at: float, step: int, subject: int, placed: Sequence[float] = ()) -> list[float]:
    """Return the first values of the EventRow of a change; placed: pose (4) and covariance (16) of a PLACED one."""
    return [at, kind, 0, subject, 0, step, 0, 0, 0.0, 0.0, *placed]


def _pose(pose: Measurement | PoseHypothesis) -> list[float]:
    if pose.yaw_rad is None:
        return _padded(pose.position_m, pose.covariance)
    return _padded((*pose.position_m, pose.yaw_rad), pose.covariance)


def _padded(z: tuple[float, ...], covariance: tuple[float, ...]) -> list[float]:
    """Return z (4) and its covariance (16), missing rows filled up from an identity."""
    rows = len(z)
    if not 1 <= rows <= 4 or len(covariance) != rows * rows:
        raise ValueError(f"a reading has 1 to 4 rows and a square covariance (got {rows}, {len(covariance)})")
    if rows == 4:
        return [*z, *covariance]
    full = [*_IDENTITY]
    for i in range(rows):
        full[4 * i : 4 * i + rows] = covariance[rows * i : rows * (i + 1)]
    return [*z, *[0.0] * (4 - rows), *full]

"""Events in order of measurement time, in rows that the compiled filter reads."""

import math
import struct
from bisect import bisect_left, insort

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.messages import PoseHypothesis, Verdict
from groundstation.estimation import slots as s
from groundstation.estimation.measurement import Correction, Measurement, Reading

_VERDICTS = {
    s.ACCEPTED: (Verdict.ACCEPTED, ""),
    s.INFLATED: (Verdict.INFLATED, "beyond the gate"),
    s.IMPLAUSIBLE: (Verdict.IMPLAUSIBLE, "far beyond the gate"),
    s.OUT_OF_VIEW: (Verdict.OUT_OF_VIEW, "behind the camera"),
    s.SINGULAR: (Verdict.SINGULAR, "covariance is not positive definite"),
    s.OBSERVER_UNKNOWN: (Verdict.UNKNOWN_ENTITY, "the observer has no belief yet"),
    s.OBSERVER_UNCONFIRMED: (Verdict.UNKNOWN_ENTITY, "the observer was seen only once so far"),
    s.SUBJECT_GROUNDED: (Verdict.UNKNOWN_ENTITY, "the subject does not fly"),
    s.YAW_MISSING: (Verdict.AMBIGUOUS, "a robot joins only with a heading"),
    s.MISTAKEN: (Verdict.IMPLAUSIBLE, "far beyond the gate, but fits another entity: is its marker's id right?"),
    s.OBSERVER_DOUBTED: (Verdict.IMPLAUSIBLE, "far beyond the gate, as is its observer itself"),
    s.NOT_LOCATED: (Verdict.AMBIGUOUS, "this sensor alone cannot tell where its subject is"),
}
_ROW, _REST = struct.Struct(f"{s.EVENT_COLUMNS}d"), (0.0,) * s.EVENT_COLUMNS
_IDENTITY = tuple(np.eye(4).ravel().tolist())


class EventLog:
    """A pool of event rows with their outcomes, listed by (time, tie-breaker) so that arrival order cannot matter."""

    def __init__(self, capacity: int = 256) -> None:
        self.events = np.zeros((capacity, s.EVENT_COLUMNS))
        self.outcomes = np.zeros((capacity, s.OUT_COLUMNS))
        self._free = list(range(capacity))
        self._order: list[tuple[int, str, int]] = []

    def add(self, stamp_ns: int, tie: str, columns: list[float]) -> int:
        """Insert an event whose leading columns are given; returns its row."""
        if not self._free:
            self._grow()
        row = self._free.pop()
        _ROW.pack_into(self.events.data, row * _ROW.size, *columns, *_REST[len(columns) :])
        self.outcomes[row] = 0.0
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

    def verdict_code(self, row: int) -> int:
        """Return what became of an event so far; PENDING before it was reached."""
        return int(self.outcomes[row, s.OUT_VERDICT])

    def correction(self, row: int, observer: str, subject: str, latency_ms: float) -> Correction:
        """Return the outcome of an observation as a value."""
        out = self.outcomes[row].tolist()
        verdict, reason = _VERDICTS[int(out[s.OUT_VERDICT])]
        size = int(out[s.OUT_SIZE])
        joined = bool(out[s.OUT_JOINED])
        if joined:
            reason = "joined" if size == 0 else "re-initialised: the belief contradicted several observations in a row"
        elif out[s.OUT_OTHER_CHOSEN]:
            reason = (reason + "; " if reason else "") + "the other pose hypothesis is more likely"
        if size == 0:
            return Correction(observer, subject, verdict, reason, latency_ms=latency_ms, joined=joined)
        residual = tuple(out[s.OUT_RESIDUAL : s.OUT_RESIDUAL + size])
        covariance = tuple(out[s.OUT_COVARIANCE : s.OUT_COVARIANCE + size * size])
        nis = out[s.OUT_NIS]
        if not 0.0 <= nis < math.inf:
            return Correction(observer, subject, verdict, reason, latency_ms=latency_ms)
        return Correction(observer, subject, verdict, reason, residual, covariance, nis, latency_ms, joined)

    def _grow(self) -> None:
        size = len(self.events)
        self.events = np.vstack((self.events, np.zeros_like(self.events)))
        self.outcomes = np.vstack((self.outcomes, np.zeros_like(self.outcomes)))
        self._free.extend(range(size, 2 * size))


def observation_columns(
    m: Measurement | Reading, at: float, step: int, observer: int, subject: int, sensor: int
) -> list[float]:
    """Return the columns of an observation event (slots.py); raises ValueError for a reading of the wrong shape."""
    other = m.alternative if isinstance(m, Measurement) else None
    columns = [
        at,
        s.EVENT_OBSERVATION,
        observer,
        subject,
        sensor,
        m.roll_rad,
        m.pitch_rad,
        float(other is not None),
        step,
    ]
    if isinstance(m, Reading):
        return columns + _padded(m.z, m.covariance) + [float(len(m.z))]
    columns += _hypothesis(PoseHypothesis(m.position_m, m.yaw_rad, m.covariance))
    columns.append(3.0 if m.yaw_rad is None else 4.0)
    if other is not None:
        columns += _hypothesis(other)
    return columns


def _hypothesis(pose: PoseHypothesis) -> list[float]:
    yaw = () if pose.yaw_rad is None else (pose.yaw_rad,)
    return _padded((*pose.position_m, *yaw), pose.covariance)


def _padded(z: tuple[float, ...], covariance: tuple[float, ...]) -> list[float]:
    """Return z (4) and its covariance (16), the rows that it lacks filled up with those of an identity."""
    rows = len(z)
    if not 1 <= rows <= 4 or len(covariance) != rows * rows:
        raise ValueError(f"a reading has 1 to 4 rows and a square covariance (got {rows}, {len(covariance)})")
    if rows == 4:
        return [*z, *covariance]
    full = [*_IDENTITY]
    for i in range(rows):
        full[4 * i : 4 * i + rows] = covariance[rows * i : rows * (i + 1)]
    return [*z, *[0.0] * (4 - rows), *full]

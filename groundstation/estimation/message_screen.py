"""Checks messages before any computation: shapes and sizes, duplicates, frozen sensors."""

import math
from operator import itemgetter

from groundstation.bus.messages import (
    FlightState,
    ImuSample,
    Message,
    Odometry,
    PoseHypothesis,
    RangeObservation,
    RelativeObservation,
    ReportedMotion,
    VehicleStatus,
    Verdict,
)
from groundstation.estimation.fixed_lag import FUTURE_NS
from groundstation.estimation.frozen_sensor import FreezeWatch, Novelty
from groundstation.estimation.parameters import EstimatorParameters

# No vehicle here moves this fast or far [m/s, m, rad]; a number that is merely finite can still overflow the filter.
_ABSURD = 1e3
_MOST_VARIANCE = 1e12  # a driver may call an entry unknown by a large one; squares of still larger ones overflow
# Message identities kept per key to find duplicates: all that are not late yet, but no more than these.
_REMEMBERED, _REMEMBERED_AT_MOST = 512, 8192
# A working sensor does not repeat itself this often for this long [s].
_FROZEN_ODOMETRY, _FROZEN_SIGHT = (10, 0.5), (4, 0.3)
_SYMMETRY = 1e-6  # for covariances, relative to the deviations of their rows
# Extracts the triangles of row-major values, by rows: most covariances are exactly symmetric.
_TRIANGLES = {
    3: (itemgetter(1, 2, 5), itemgetter(3, 6, 7)),
    4: (itemgetter(1, 2, 3, 6, 7, 11), itemgetter(4, 8, 12, 9, 13, 14)),
}
_STALE = {Novelty.NEW: None, Novelty.REPEATED: Verdict.DUPLICATE, Novelty.FROZEN: Verdict.FROZEN}


class MessageScreen:
    """Judges messages one by one, each against earlier ones.

    parameters: which vehicles' rounded values may repeat, how fast each can be; lag_ns: older messages are too late.
    """

    def __init__(self, parameters: EstimatorParameters, lag_ns: int) -> None:
        self._tells_steps, self._fastest_m_s = parameters.tells_steps, parameters.fastest_m_s
        self._lag_ns = lag_ns
        self._seen: dict[str, dict[tuple[int, int], int]] = {}
        self._odometry_watch, self._sight_watch = FreezeWatch(*_FROZEN_ODOMETRY), FreezeWatch(*_FROZEN_SIGHT)
        self._standing: dict[str, tuple[int, bool]] = {}

    def stands(self, entity: str) -> bool:
        """Return whether a vehicle's last report says that it is on the ground."""
        return self._standing.get(entity, (0, False))[1]

    def refusal(self, key: str, message: Message, stamp_ns: int, now_ns: int) -> Verdict | None:
        """Return why a message that came under a key must not be used, or None; stamp_ns: of our clock, as now_ns."""
        if not isinstance(message, ImuSample) and self._is_duplicate(key, message, stamp_ns, now_ns):
            return Verdict.DUPLICATE
        match message:
            case RelativeObservation():
                return self._observation(message, stamp_ns)
            case Odometry():
                return self._odometry(message, stamp_ns, now_ns)
            case ImuSample():
                return Verdict.IMPLAUSIBLE if stamp_ns > now_ns + FUTURE_NS else None
            case RangeObservation():
                return self._range(message, stamp_ns, now_ns)
            case ReportedMotion():
                return _fault_of_report(message)
            case VehicleStatus():
                return self._status(message, stamp_ns, now_ns)
        return None

    def _status(self, message: VehicleStatus, stamp_ns: int, now_ns: int) -> Verdict | None:
        if stamp_ns > now_ns + FUTURE_NS:
            return Verdict.IMPLAUSIBLE
        entity = message.header.entity
        if stamp_ns >= self._standing.get(entity, (0, False))[0]:
            self._standing[entity] = stamp_ns, message.flight_state is FlightState.LANDED
        return None

    def _odometry(self, message: Odometry, stamp_ns: int, now_ns: int) -> Verdict | None:
        attitude = (message.yaw_rad, message.roll_rad, message.pitch_rad)
        if len(message.velocity_m_s) != 3 or not _plausible(*message.velocity_m_s, *attitude, message.height_m or 0.0):
            return Verdict.IMPLAUSIBLE
        if not _plausible(message.attitude_std_rad, *message.velocity_covariance):
            return Verdict.IMPLAUSIBLE
        entity = message.header.entity
        too_fast = math.hypot(*message.velocity_m_s) > self._fastest_m_s.get(entity, math.inf)
        if too_fast or stamp_ns > now_ns + FUTURE_NS:
            return Verdict.IMPLAUSIBLE
        values = (message.velocity_m_s, *attitude, message.height_m)
        frozen = self._odometry_watch.is_frozen(entity, values, stamp_ns) and entity not in self._tells_steps
        # A vehicle that reports whole numbers repeats them while it stands.
        return Verdict.FROZEN if frozen and not self.stands(entity) else None

    def _observation(self, message: RelativeObservation, stamp_ns: int) -> Verdict | None:
        if message.header.entity != message.observer:
            return Verdict.UNKNOWN_ENTITY
        fault = _fault_of(message)
        other = message.alternative
        if fault is None and other is not None:
            lacks_heading = other.yaw_rad is None and message.yaw_rad is not None
            fault = Verdict.SINGULAR if lacks_heading else _fault_of(other)
        if fault is not None:
            return fault
        if not _plausible(message.roll_rad, message.pitch_rad):
            return Verdict.IMPLAUSIBLE
        # One picture can be measured twice with other last digits: the search begins elsewhere.
        values = (message.picture_ns,) if message.picture_ns else (message.position_m, message.yaw_rad)
        return self._stale((message.observer, message.camera, message.subject), values, stamp_ns)

    def _range(self, message: RangeObservation, stamp_ns: int, now_ns: int) -> Verdict | None:
        # A round of ranges places a robot by itself, before the filter checks its age.
        if stamp_ns < now_ns - self._lag_ns:
            return Verdict.LATE
        values = (*message.ranges_m.values(), *(message.position_m or ()), message.std_m)
        usable = _plausible(*values, *message.covariance) and message.std_m > 0.0
        if not usable or stamp_ns > now_ns + FUTURE_NS:
            return Verdict.IMPLAUSIBLE
        if message.position_m is not None and (
            len(message.position_m) != 3 or not _is_covariance(message.covariance, 3)
        ):
            return Verdict.SINGULAR
        told = tuple(sorted(message.ranges_m.items()))
        return self._stale((message.observer, "", message.subject), told, stamp_ns) if len(told) > 1 else None

    def _stale(self, source: tuple[str, ...], values: tuple[object, ...], stamp_ns: int) -> Verdict | None:
        """Return why a reading is not new, or None: no second picture measures exactly the same."""
        return _STALE[self._sight_watch.judge(source, values, stamp_ns)]

    def _is_duplicate(self, key: str, message: Message, stamp_ns: int, now_ns: int) -> bool:
        header = message.header
        identity = (header.seq, header.stamp_ns)
        seen = self._seen.get(key)
        if seen is None:
            seen = self._seen[key] = {}
        elif identity in seen:
            return True
        seen[identity] = stamp_ns
        # Beyond the rewind a message is late anyway; all that could still count is remembered.
        while len(seen) > _REMEMBERED:
            oldest = next(iter(seen))
            if seen[oldest] >= now_ns - self._lag_ns and len(seen) <= _REMEMBERED_AT_MOST:
                break
            del seen[oldest]
        return False


def _fault_of_report(message: ReportedMotion) -> Verdict | None:
    velocity = message.velocity_m_s
    usable = len(velocity) == 2 and _plausible(*velocity, message.std_m_s) and message.std_m_s > 0.0
    return None if usable else Verdict.IMPLAUSIBLE


def _fault_of(pose: RelativeObservation | PoseHypothesis) -> Verdict | None:
    """Return why a measured pose cannot be used with any belief, or None."""
    if len(pose.position_m) != 3 or not _plausible(*pose.position_m, pose.yaw_rad or 0.0):
        return Verdict.IMPLAUSIBLE
    if not math.isfinite(sum(pose.covariance)) or max(pose.covariance, default=0.0) > _MOST_VARIANCE:
        return Verdict.IMPLAUSIBLE
    rows = 3 if pose.yaw_rad is None else 4
    return None if _is_covariance(pose.covariance, rows) else Verdict.SINGULAR


def _is_covariance(values: tuple[float, ...], rows: int) -> bool:
    """Return whether row-major values are square, of positive variances and symmetric (the filter does the rest)."""
    if len(values) != rows * rows:
        return False
    variances = values[:: rows + 1]
    if min(variances) <= 0.0:
        return False
    upper, lower = _TRIANGLES[rows]
    return upper(values) == lower(values) or all(
        abs(values[i * rows + j] - values[j * rows + i])
        <= _SYMMETRY * math.sqrt(variances[i]) * math.sqrt(variances[j])
        for i in range(rows)
        for j in range(i)
    )


def _plausible(*values: float) -> bool:
    for value in values:  # noqa: SIM110 - a third of the time of a generator, ten thousand times a second
        if not -_ABSURD < value < _ABSURD:  # false for nan
            return False
    return True

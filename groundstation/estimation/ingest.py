"""From bus messages to the filter: clocks, duplicates, checks of shape, and a verdict for each refusal."""

import math
from collections.abc import Container
from operator import itemgetter

from groundstation.bus.messages import (
    ClockOffset,
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
from groundstation.estimation.attitude_intake import AttitudeIntake
from groundstation.estimation.fixed_lag import FUTURE_NS, FixedLagFilter
from groundstation.estimation.frozen_sensor import FreezeWatch, Novelty
from groundstation.estimation.measurement import Measurement
from groundstation.estimation.range_intake import RangeIntake
from groundstation.estimation.report_intake import ReportIntake

_AIRBORNE = {
    FlightState.FLYING: True,
    FlightState.HOVERING: True,
    FlightState.LANDED: False,
    FlightState.EMERGENCY: False,
}
# No vehicle here moves so fast or so far [m/s, m, rad]; a number that is merely finite can still overflow the filter.
_ABSURD = 1e3
# Message identities per key against which duplicates are looked for: all that are not late yet, but no more than these.
_REMEMBERED, _REMEMBERED_AT_MOST = 512, 8192
# A sensor that still measures does not repeat itself so often for so long [s].
_FROZEN_ODOMETRY, _FROZEN_SIGHT = (10, 0.5), (4, 0.3)
_SYMMETRY = 1e-6  # of covariances, beside the deviations of their rows
# What takes the triangles out of row-major values, by rows: most covariances are symmetric to the bit.
_TRIANGLES = {
    3: (itemgetter(1, 2, 5), itemgetter(3, 6, 7)),
    4: (itemgetter(1, 2, 3, 6, 7, 11), itemgetter(4, 8, 12, 9, 13, 14)),
}

_HEARD = (Odometry, RelativeObservation, RangeObservation, ReportedMotion, VehicleStatus, ImuSample)
_STALE = {Novelty.NEW: None, Novelty.REPEATED: Verdict.DUPLICATE, Novelty.FROZEN: Verdict.FROZEN}

REASONS = {
    Verdict.LATE: "older than the rewind reaches",
    Verdict.UNSYNCED: "its clock has no known offset",
    Verdict.UNKNOWN_ENTITY: "observer, camera or subject is not in the field",
    Verdict.DUPLICATE: "already had this message, or this reading",
    Verdict.NOT_PERMITTED: "this camera must not observe targets",
    Verdict.IMPLAUSIBLE: "not finite, absurdly large, or from the future",
    Verdict.SINGULAR: "covariance is of the wrong shape, not symmetric, or not positive",
    Verdict.FROZEN: "repeats itself to the last bit: its sensor or stream hangs",
}


class Intake:
    """Feeds a filter with messages; `clock` is the id of the boot clock that `now_ns` is read from."""

    def __init__(self, joint: FixedLagFilter, cameras: Container[str], clock: str) -> None:
        self._filter = joint
        self._cameras = cameras
        self._clock = clock
        self._lag_ns = round(joint.parameters.max_lateness_s * 1e9)
        self._offsets: dict[str, int] = {}
        self._seen: dict[str, dict[tuple[int, int], int]] = {}
        self._newest_status: dict[str, int] = {}
        self._odometry_watch, self._sight_watch = FreezeWatch(*_FROZEN_ODOMETRY), FreezeWatch(*_FROZEN_SIGHT)
        self._attitudes = AttitudeIntake(joint.parameters.inertial)
        self.ranges = RangeIntake(joint, joint.parameters.ranging)
        self.reports = ReportIntake(joint, joint.parameters.reporting)
        self._joins_early, self._tells_steps = joint.parameters.joins_early, joint.parameters.tells_steps
        self._standing: dict[str, tuple[int, bool]] = {}

    def take(self, key: str, message: Message, now_ns: int) -> Verdict:
        """Take one message that came under a key; ACCEPTED, or why not. Other kinds of messages are none of ours."""
        if isinstance(message, ClockOffset):
            if message.header.clock == self._clock:
                self._offsets[message.of] = message.offset_ns
            return Verdict.ACCEPTED
        if not isinstance(message, _HEARD):
            return Verdict.ACCEPTED
        stamp_ns = self._local_stamp(message)
        if stamp_ns is None:
            return Verdict.UNSYNCED
        if isinstance(message, ImuSample):
            if stamp_ns > now_ns + FUTURE_NS:
                return Verdict.IMPLAUSIBLE
            return self._attitudes.imu(message, stamp_ns, self._standing.get(message.header.entity, (0, False))[1])
        if self._is_duplicate(key, message, stamp_ns, now_ns):
            return Verdict.DUPLICATE
        if isinstance(message, Odometry):
            return self._odometry(message, stamp_ns, now_ns)
        if isinstance(message, RelativeObservation):
            return self._observation(key, message, stamp_ns, now_ns)
        if isinstance(message, RangeObservation):
            return self._range(key, message, stamp_ns, now_ns)
        if isinstance(message, ReportedMotion):
            return self._report(key, message, stamp_ns, now_ns)
        return self._status(message, stamp_ns, now_ns)

    def _status(self, message: VehicleStatus, stamp_ns: int, now_ns: int) -> Verdict:
        entity, airborne = message.header.entity, _AIRBORNE.get(message.flight_state)
        if message.flight_state is FlightState.TAKING_OFF and entity in self._joins_early:
            airborne = True
        if stamp_ns > now_ns + FUTURE_NS:
            return Verdict.IMPLAUSIBLE
        self._note_standing(entity, message.flight_state is FlightState.LANDED, stamp_ns)
        if airborne is None:
            return Verdict.ACCEPTED
        # The newest word counts however late it comes; an older one must not undo it.
        if stamp_ns < self._newest_status.get(entity, stamp_ns) and stamp_ns < now_ns - self._lag_ns:
            return Verdict.LATE
        verdict = self._filter.set_airborne(entity, airborne, stamp_ns, now_ns)
        if verdict is Verdict.ACCEPTED:
            self._newest_status[entity] = max(stamp_ns, self._newest_status.get(entity, stamp_ns))
        return verdict

    def _note_standing(self, entity: str, stands: bool, stamp_ns: int) -> None:
        """Remember whether a vehicle said last that it is on the ground."""
        if stamp_ns < self._standing.get(entity, (0, False))[0]:
            return
        self._standing[entity] = stamp_ns, stands

    def _odometry(self, message: Odometry, stamp_ns: int, now_ns: int) -> Verdict:
        attitude = (message.yaw_rad, message.roll_rad, message.pitch_rad)
        if len(message.velocity_m_s) != 3 or not _plausible(*message.velocity_m_s, *attitude, message.height_m or 0.0):
            return Verdict.IMPLAUSIBLE
        if stamp_ns > now_ns + FUTURE_NS:
            return Verdict.IMPLAUSIBLE
        values = (message.velocity_m_s, *attitude, message.height_m)
        entity = message.header.entity
        frozen = self._odometry_watch.is_frozen(entity, values, stamp_ns) and entity not in self._tells_steps
        # A vehicle that tells whole numbers repeats them as long as it stands.
        if frozen and not self._standing.get(entity, (0, False))[1]:
            return Verdict.FROZEN
        self.ranges.hear(message, stamp_ns)
        return self._filter.add_motion(entity, self._attitudes.motion(message, stamp_ns), now_ns)

    def _observation(self, key: str, message: RelativeObservation, stamp_ns: int, now_ns: int) -> Verdict:
        if message.header.entity != message.observer:
            return Verdict.UNKNOWN_ENTITY
        for pose in (message, message.alternative):
            fault = _fault_of(pose) if pose is not None else None
            if fault is not None:
                return fault
        if not _plausible(message.roll_rad, message.pitch_rad):
            return Verdict.IMPLAUSIBLE
        values = (message.position_m, message.yaw_rad)
        if stale := self._stale((message.observer, message.camera, message.subject), values, stamp_ns):
            return stale
        roll_rad, pitch_rad = self._tilt(message, stamp_ns)
        measurement = Measurement(
            stamp_ns,
            message.camera if message.camera in self._cameras else message.observer,
            message.subject,
            message.position_m,
            message.yaw_rad,
            message.covariance,
            roll_rad,
            pitch_rad,
            message.alternative,
        )
        tie = f"{key}#{message.subject}#{message.header.seq}"
        return self._filter.add_observation(measurement, tie, now_ns) or Verdict.ACCEPTED

    def _range(self, key: str, message: RangeObservation, stamp_ns: int, now_ns: int) -> Verdict:
        values = (*message.ranges_m.values(), *(message.position_m or ()), message.std_m)
        if not _plausible(*values, *message.covariance) or not message.std_m > 0.0:
            return Verdict.IMPLAUSIBLE
        if message.position_m is not None and (
            len(message.position_m) != 3 or not _is_covariance(message.covariance, 3)
        ):
            return Verdict.SINGULAR
        told = tuple(sorted(message.ranges_m.items()))
        if len(told) > 1 and (stale := self._stale((message.observer, "", message.subject), told, stamp_ns)):
            return stale
        return self.ranges.take(key, message, stamp_ns, now_ns)

    def _report(self, key: str, message: ReportedMotion, stamp_ns: int, now_ns: int) -> Verdict:
        velocity = message.velocity_m_s
        if len(velocity) != 2 or not _plausible(*velocity, message.std_m_s) or not message.std_m_s > 0.0:
            return Verdict.IMPLAUSIBLE
        return self.reports.take(key, message, stamp_ns, now_ns)

    def _stale(self, source: tuple[str, ...], values: tuple[object, ...], stamp_ns: int) -> Verdict | None:
        """Return why a reading says nothing new, or None: no second picture measures the same to the last bit."""
        return _STALE[self._sight_watch.judge(source, values, stamp_ns)]

    def _tilt(self, message: RelativeObservation, stamp_ns: int) -> tuple[float, float]:
        return self._attitudes.tilt(message.observer, stamp_ns, (message.roll_rad, message.pitch_rad))

    def _local_stamp(self, message: Message) -> int | None:
        if message.header.clock == self._clock:
            return message.header.stamp_ns
        offset = self._offsets.get(message.header.clock)
        return None if offset is None else message.header.stamp_ns + offset

    def _is_duplicate(self, key: str, message: Message, stamp_ns: int, now_ns: int) -> bool:
        identity = (message.header.seq, message.header.stamp_ns)
        seen = self._seen.setdefault(key, {})
        if identity in seen:
            return True
        seen[identity] = stamp_ns
        # Beyond the rewind a message is late by itself; what could still count is remembered at any rate.
        while len(seen) > _REMEMBERED:
            oldest = next(iter(seen))
            if seen[oldest] >= now_ns - self._lag_ns and len(seen) <= _REMEMBERED_AT_MOST:
                break
            del seen[oldest]
        return False


def _fault_of(pose: RelativeObservation | PoseHypothesis) -> Verdict | None:
    """Return why a measured pose cannot be used whatever the belief, or None."""
    if len(pose.position_m) != 3 or not _plausible(*pose.position_m, pose.yaw_rad or 0.0):
        return Verdict.IMPLAUSIBLE
    if not all(map(math.isfinite, pose.covariance)):
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
        if not -_ABSURD < value < _ABSURD:  # nan compares false
            return False
    return True

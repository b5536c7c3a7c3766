"""Feeds bus messages to the filter: converts clocks, and returns a verdict for each refusal."""

from collections.abc import Mapping

from groundstation.bus.messages import (
    ClockOffset,
    FlightState,
    ImuSample,
    Message,
    Odometry,
    RangeObservation,
    RelativeObservation,
    ReportedMotion,
    SearchedPicture,
    VehicleStatus,
    Verdict,
    flies,
)
from groundstation.estimation.attitude_intake import AttitudeIntake
from groundstation.estimation.belief_history import KEPT_NS
from groundstation.estimation.fixed_lag import FUTURE_NS, FixedLagFilter
from groundstation.estimation.measurement import Measurement
from groundstation.estimation.message_screen import MessageScreen
from groundstation.estimation.models.protocol import ObservationModel
from groundstation.estimation.range_intake import RangeIntake
from groundstation.estimation.report_intake import ReportIntake

_HEARD = (RelativeObservation, Odometry, ImuSample, RangeObservation, ReportedMotion, VehicleStatus)  # often first

REASONS = {
    Verdict.LATE: "older than the rewind reaches",
    Verdict.UNSYNCED: "its clock has no known offset",
    Verdict.UNKNOWN_ENTITY: "observer, camera or subject is not in the field",
    Verdict.DUPLICATE: "already had this message, or this reading",
    Verdict.NOT_PERMITTED: "this camera must not observe targets",
    Verdict.IMPLAUSIBLE: "not finite, absurdly large, or from the future",
    Verdict.SINGULAR: "covariance is of the wrong shape, not symmetric, or not positive",
    Verdict.FROZEN: "repeats itself: its sensor or stream hangs",
}


class Intake:
    """Feeds a filter with messages; `clock` is the id of the boot clock that `now_ns` is read from."""

    def __init__(self, joint: FixedLagFilter, cameras: Mapping[str, ObservationModel], clock: str) -> None:
        self._filter = joint
        self._cameras = cameras
        self._clock = clock
        self._lag_ns = round(joint.parameters.max_lateness_s * 1e9)
        self._offsets: dict[str, int] = {}
        self._newest_status: dict[str, int] = {}
        self._screen = MessageScreen(joint.parameters, self._lag_ns)
        self._attitudes = AttitudeIntake(joint.parameters.inertial)
        self.ranges = RangeIntake(joint, joint.parameters.ranging)
        self.reports = ReportIntake(joint, joint.parameters.reporting)
        self._joins_early = joint.parameters.joins_early

    def take(self, key: str, message: Message, now_ns: int) -> Verdict:
        """Take one message that came under a key; return ACCEPTED, or why not. Other kinds of messages are ignored."""
        if not isinstance(message, _HEARD):
            return self._other(key, message, now_ns)
        stamp_ns = self._local_stamp(message)
        if stamp_ns is None:
            return Verdict.UNSYNCED
        refusal = self._screen.refusal(key, message, stamp_ns, now_ns)
        if refusal is not None:
            return refusal
        if isinstance(message, RelativeObservation):
            return self._observation(key, message, stamp_ns, now_ns)
        if isinstance(message, Odometry):
            self.ranges.take_heading(message, stamp_ns, self._screen.stands(message.header.entity))
            return self._filter.add_motion(message.header.entity, self._attitudes.motion(message, stamp_ns), now_ns)
        if isinstance(message, ImuSample):
            return self._attitudes.imu(message, stamp_ns, self._screen.stands(message.header.entity))
        if isinstance(message, RangeObservation):
            return self.ranges.take(key, message, stamp_ns, now_ns)
        if isinstance(message, ReportedMotion):
            return self.reports.take(key, message, stamp_ns, now_ns)
        return self._status(message, stamp_ns, now_ns)

    def _other(self, key: str, message: Message, now_ns: int) -> Verdict:
        """Take a message without information on places."""
        if isinstance(message, ClockOffset) and message.header.clock == self._clock:
            self._offsets[message.of] = message.offset_ns
        if isinstance(message, SearchedPicture):
            stamp_ns = self._local_stamp(message)
            if stamp_ns is not None:
                return self._searched(key, message, stamp_ns, now_ns)
        return Verdict.ACCEPTED

    def _searched(self, key: str, message: SearchedPicture, stamp_ns: int, now_ns: int) -> Verdict:
        """Take a searched picture: each one is evidence once, and only with the belief of its time."""
        if stamp_ns > now_ns + FUTURE_NS:
            return Verdict.IMPLAUSIBLE
        if stamp_ns <= now_ns - max(KEPT_NS, self._lag_ns):
            return Verdict.LATE
        return self._screen.refusal(key, message, stamp_ns, now_ns) or Verdict.ACCEPTED

    def _status(self, message: VehicleStatus, stamp_ns: int, now_ns: int) -> Verdict:
        entity, airborne = message.header.entity, flies(message.flight_state, message.mode)
        if message.flight_state is FlightState.TAKING_OFF and entity in self._joins_early:
            airborne = True
        if airborne is None:
            return Verdict.ACCEPTED
        # The newest status counts however late it comes; an older one must not undo it.
        if stamp_ns < self._newest_status.get(entity, stamp_ns) and stamp_ns < now_ns - self._lag_ns:
            return Verdict.LATE
        verdict = self._filter.set_airborne(entity, airborne, stamp_ns, now_ns)
        if verdict is Verdict.ACCEPTED:
            self._newest_status[entity] = max(stamp_ns, self._newest_status.get(entity, stamp_ns))
        return verdict

    def _observation(self, key: str, message: RelativeObservation, stamp_ns: int, now_ns: int) -> Verdict:
        roll_rad, pitch_rad = self._tilt(message, stamp_ns)
        measurement = Measurement(
            stamp_ns,
            self._camera_of(message),
            message.subject,
            message.position_m,
            message.yaw_rad,
            message.covariance,
            roll_rad,
            pitch_rad,
            message.alternative,
        )
        tie = f"{key}#{message.subject}#{message.header.seq}"
        verdict = self._filter.add_observation(measurement, tie, now_ns) or Verdict.ACCEPTED
        if verdict is Verdict.ACCEPTED and message.observer in self._filter.parameters.world_cameras:
            self._attitudes.sight(message, measurement.camera, stamp_ns)
        return verdict

    def _camera_of(self, message: RelativeObservation) -> str:
        """Return the camera by which an observer saw: its own, whatever the message calls it."""
        named = self._cameras.get(message.camera)
        return message.camera if named is not None and named.carrier == message.observer else message.observer

    def _tilt(self, message: RelativeObservation, stamp_ns: int) -> tuple[float, float]:
        return self._attitudes.tilt(message.observer, stamp_ns, (message.roll_rad, message.pitch_rad))

    def _local_stamp(self, message: Message) -> int | None:
        header = message.header
        if header.clock == self._clock:
            return header.stamp_ns
        offset = self._offsets.get(header.clock)
        return None if offset is None else header.stamp_ns + offset

"""From bus messages to the filter: clocks, duplicates, what can be used, and a verdict for what cannot."""

import math
from collections.abc import Container

from groundstation.bus.messages import (
    ClockOffset,
    FlightState,
    Message,
    Odometry,
    RelativeObservation,
    VehicleStatus,
    Verdict,
)
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement, Motion

_AIRBORNE = {
    FlightState.FLYING: True,
    FlightState.HOVERING: True,
    FlightState.LANDED: False,
    FlightState.EMERGENCY: False,
}
# No vehicle here moves so fast or so far [m/s, m, rad]; a number that is merely finite can still overflow the filter.
_ABSURD = 1e3
_REMEMBERED = 512  # message identities per key against which duplicates are looked for

REASONS = {
    Verdict.LATE: "older than the rewind reaches",
    Verdict.UNSYNCED: "its clock has no known offset",
    Verdict.UNKNOWN_ENTITY: "observer, camera or subject is not in the field",
    Verdict.DUPLICATE: "already had this message",
    Verdict.NOT_PERMITTED: "this camera must not observe targets",
    Verdict.IMPLAUSIBLE: "not finite, absurdly large, or from the future",
}


class Intake:
    """Feeds a filter with messages; `clock` is the id of the boot clock that `now_ns` is read from."""

    def __init__(self, joint: FixedLagFilter, cameras: Container[str], clock: str) -> None:
        self._filter = joint
        self._cameras = cameras
        self._clock = clock
        self._offsets: dict[str, int] = {}
        self._seen: dict[str, dict[tuple[int, int], None]] = {}

    def take(self, key: str, message: Message, now_ns: int) -> Verdict:
        """Take one message that came under a key; ACCEPTED, or why not. Other kinds of messages are none of ours."""
        if isinstance(message, ClockOffset):
            if message.header.clock == self._clock:
                self._offsets[message.of] = message.offset_ns
            return Verdict.ACCEPTED
        if not isinstance(message, Odometry | RelativeObservation | VehicleStatus):
            return Verdict.ACCEPTED
        stamp_ns = self._local_stamp(message)
        if stamp_ns is None:
            return Verdict.UNSYNCED
        if self._is_duplicate(key, message):
            return Verdict.DUPLICATE
        if isinstance(message, Odometry):
            return self._odometry(message, stamp_ns, now_ns)
        if isinstance(message, RelativeObservation):
            return self._observation(key, message, stamp_ns, now_ns)
        airborne = _AIRBORNE.get(message.flight_state)
        if airborne is None:
            return Verdict.ACCEPTED
        return self._filter.set_airborne(message.header.entity, airborne, stamp_ns, now_ns)

    def _odometry(self, message: Odometry, stamp_ns: int, now_ns: int) -> Verdict:
        if not _plausible(*message.velocity_m_s, message.yaw_rad, message.height_m or 0.0):
            return Verdict.IMPLAUSIBLE
        motion = Motion(
            stamp_ns,
            message.velocity_m_s,
            message.yaw_rad,
            message.height_m,
            message.reset,
            roll_rad=message.roll_rad,
            pitch_rad=message.pitch_rad,
        )
        return self._filter.add_motion(message.header.entity, motion, now_ns)

    def _observation(self, key: str, message: RelativeObservation, stamp_ns: int, now_ns: int) -> Verdict:
        if not (_plausible(*message.position_m, message.yaw_rad or 0.0) and _finite(*message.covariance)):
            return Verdict.IMPLAUSIBLE
        if message.header.entity != message.observer:
            return Verdict.UNKNOWN_ENTITY
        measurement = Measurement(
            stamp_ns,
            message.camera if message.camera in self._cameras else message.observer,
            message.subject,
            message.position_m,
            message.yaw_rad,
            message.covariance,
            message.roll_rad,
            message.pitch_rad,
            message.alternative,
        )
        tie = f"{key}#{message.subject}#{message.header.seq}"
        return self._filter.add_observation(measurement, tie, now_ns) or Verdict.ACCEPTED

    def _local_stamp(self, message: Message) -> int | None:
        if message.header.clock == self._clock:
            return message.header.stamp_ns
        offset = self._offsets.get(message.header.clock)
        return None if offset is None else message.header.stamp_ns + offset

    def _is_duplicate(self, key: str, message: Message) -> bool:
        identity = (message.header.seq, message.header.stamp_ns)
        seen = self._seen.setdefault(key, {})
        if identity in seen:
            return True
        seen[identity] = None
        if len(seen) > _REMEMBERED:
            del seen[next(iter(seen))]
        return False


def _finite(*values: float) -> bool:
    return all(map(math.isfinite, values))


def _plausible(*values: float) -> bool:
    return all(abs(value) < _ABSURD for value in values)  # nan compares false

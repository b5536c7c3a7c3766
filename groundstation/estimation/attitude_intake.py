"""The attitude used for each robot: from its IMU where that is in use, else as reported."""

import math
from collections.abc import Mapping

from groundstation.bus.messages import ImuSample, Odometry, Verdict
from groundstation.estimation.frozen_sensor import FreezeWatch
from groundstation.estimation.inertial import InertialAttitude
from groundstation.estimation.measurement import OdometrySample

_FROZEN_COUNT, _FROZEN_S = 10, 0.1
_MOST = 1e3  # neither turns nor accelerations that a vehicle survives are as large


class AttitudeIntake:
    """The attitudes of robots; inertial: the names of those whose IMU is used, with their velocity scale."""

    def __init__(self, inertial: Mapping[str, float]) -> None:
        self._inertial = {name: InertialAttitude(scale) for name, scale in inertial.items()}
        self._sources = {name: _HeadingSource() for name in inertial}
        self._frozen = FreezeWatch(_FROZEN_COUNT, _FROZEN_S)

    def imu(self, message: ImuSample, stamp_ns: int, standing: bool) -> Verdict:
        """Take an IMU sample; standing: the vehicle says that it is on the ground."""
        name, rates, force = message.header.entity, message.angular_velocity_rad_s, message.specific_force_m_s2
        inertial = self._inertial.get(name)
        if inertial is None:
            return Verdict.ACCEPTED
        if len(rates) != 3 or len(force) != 3 or not all(-_MOST < value < _MOST for value in (*rates, *force)):
            return Verdict.IMPLAUSIBLE
        if self._frozen.is_frozen(name, (rates, force), stamp_ns):
            return Verdict.FROZEN
        inertial.take_imu(stamp_ns, rates, force, standing)
        return Verdict.ACCEPTED

    def motion(self, message: Odometry, stamp_ns: int) -> OdometrySample:
        """Return an odometry message as a sample, with the attitude that counts."""
        name, attitude, reset = message.header.entity, None, message.reset
        yaw_rad, roll_rad, pitch_rad = message.yaw_rad, message.roll_rad, message.pitch_rad
        attitude_std_rad, yaw_std_rad = message.attitude_std_rad, 0.0
        velocity_std_m_s = math.sqrt(max(message.velocity_covariance[0], message.velocity_covariance[4], 0.0))
        inertial = self._inertial.get(name)
        if inertial is not None:
            source = self._sources[name]
            if stamp_ns > source.newest_ns:
                inertial.take_velocity(stamp_ns, message.velocity_m_s)
                inertial.take_heading(stamp_ns, message.yaw_rad, message.reset)
            attitude = inertial.at(stamp_ns)
            reset = source.resets(stamp_ns, attitude is not None, reset if attitude is None else attitude.resets)
        if attitude is not None:
            yaw_rad, roll_rad, pitch_rad = attitude.yaw_rad, attitude.roll_rad, attitude.pitch_rad
            attitude_std_rad, yaw_std_rad = attitude.attitude_std_rad, attitude.yaw_std_rad
        return OdometrySample(
            stamp_ns,
            message.velocity_m_s,
            yaw_rad,
            message.height_m,
            reset,
            roll_rad=roll_rad,
            pitch_rad=pitch_rad,
            attitude_std_rad=attitude_std_rad,
            yaw_std_rad=yaw_std_rad,
            velocity_std_m_s=velocity_std_m_s,
        )

    def tilt(self, robot: str, stamp_ns: int, reported: tuple[float, float]) -> tuple[float, float]:
        """Return (roll, pitch) of a robot at an exposure; reported: by the camera's driver.

        The heading in a sighting was derived with the latter: of a level marker that is an error of second order.
        """
        inertial = self._inertial.get(robot)
        tilt = None if inertial is None else inertial.tilt_at(stamp_ns)
        return reported if tilt is None else tilt


class _HeadingSource:
    """Counts the resets of a heading whose source changes."""

    def __init__(self) -> None:
        self._count, self._source, self.newest_ns = 0, (False, 0), 0
        self._counted: dict[tuple[bool, int], int] = {}

    def resets(self, stamp_ns: int, inertial: bool, resets: int) -> int:
        """Return the resets until then: another source, or a reset of the present one, is one more.

        What comes late changes nothing: it belongs to the resets that its source last had.
        """
        source = inertial, resets
        if stamp_ns <= self.newest_ns:
            return self._counted.get(source, self._count)
        self.newest_ns = stamp_ns
        if source != self._source:
            self._count, self._source = self._count + 1, source
        self._counted[source] = self._count
        return self._count

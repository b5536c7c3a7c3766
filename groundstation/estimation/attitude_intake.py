"""The attitude used for each robot: from its IMU where that is in use, else as reported."""

import math
from collections.abc import Mapping

from groundstation.bus.messages import ImuSample, Odometry, RelativeObservation, Verdict
from groundstation.estimation.frozen_sensor import FreezeWatch
from groundstation.estimation.inertial import Attitude, InertialAttitude
from groundstation.estimation.measurement import OdometrySample
from groundstation.geometry.angles import difference, wrap

_FROZEN_COUNT, _FROZEN_S = 10, 0.1
_MOST = 1e3  # no vehicle survives turns or accelerations this large


class AttitudeIntake:
    """The attitudes of robots; inertial: the names of robots whose IMU is used, with their velocity scale."""

    def __init__(self, inertial: Mapping[str, float]) -> None:
        self._inertial = {name: InertialAttitude(scale) for name, scale in inertial.items()}
        self._headings = {name: _Heading() for name in inertial}
        self._frozen = FreezeWatch(_FROZEN_COUNT, _FROZEN_S)

    def imu(self, message: ImuSample, stamp_ns: int, standing: bool) -> Verdict:
        """Take an IMU sample; standing: whether the vehicle reports that it is on the ground."""
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
        """Return an odometry message as a sample, with the attitude to use."""
        name, attitude, reset = message.header.entity, None, message.reset
        yaw_rad, roll_rad, pitch_rad = message.yaw_rad, message.roll_rad, message.pitch_rad
        attitude_std_rad, yaw_std_rad = message.attitude_std_rad, 0.0
        velocity_std_m_s = math.sqrt(max(message.velocity_covariance[0], message.velocity_covariance[4], 0.0))
        inertial = self._inertial.get(name)
        if inertial is not None:
            heading = self._headings[name]
            if stamp_ns > heading.newest_ns:
                inertial.take_velocity(stamp_ns, message.velocity_m_s)
                inertial.take_heading(stamp_ns, message.yaw_rad, message.reset)
            attitude = inertial.at(stamp_ns)
            yaw_rad, reset = heading.take(stamp_ns, message.yaw_rad, message.reset, attitude)
        if attitude is not None:
            roll_rad, pitch_rad = attitude.roll_rad, attitude.pitch_rad
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

    def sight(self, message: RelativeObservation, camera: str, stamp_ns: int) -> None:
        """Take a fixed camera's sighting, which shows how its subject turns."""
        inertial = self._inertial.get(message.subject)
        if inertial is not None and message.yaw_rad is not None:
            inertial.take_sight(camera, stamp_ns, message.yaw_rad, message.covariance[-1])

    def tilt(self, robot: str, stamp_ns: int, reported: tuple[float, float]) -> tuple[float, float]:
        """Return (roll, pitch) of a robot at an exposure; reported: by the camera's driver.

        The heading in a sighting was derived with the reported tilt: for a level marker that is a second-order error.
        """
        inertial = self._inertial.get(robot)
        tilt = None if inertial is None else inertial.tilt_at(stamp_ns)
        return reported if tilt is None else tilt


class _Heading:
    """A heading with changing sources: gyroscopes, the vehicle's own heading in their silence, restarted gyroscopes.

    Between sources it continues by the change of the vehicle's own heading meanwhile; if that jumped, it is reset.
    """

    def __init__(self) -> None:
        self._source, self._own, self.newest_ns = (False, 0), (0.0, 0), 0
        self._yaw_rad, self._count = 0.0, 0
        self._told: dict[tuple[bool, int], tuple[float, int]] = {}

    def take(self, stamp_ns: int, own_rad: float, own_reset: int, attitude: Attitude | None) -> tuple[float, int]:
        """Return the heading, and how often it was reset until then.

        Late samples change nothing.
        """
        source, read_rad = (False, own_reset), own_rad
        if attitude is not None:
            source, read_rad = (True, attitude.resets), attitude.yaw_rad
        if stamp_ns > self.newest_ns:
            self._go_on(stamp_ns, source, read_rad, (own_rad, own_reset))
        ahead_rad, count = self._told.get(source, (0.0, self._count))
        return wrap(read_rad + ahead_rad), count

    def _go_on(self, stamp_ns: int, source: tuple[bool, int], read_rad: float, own: tuple[float, int]) -> None:
        if source != self._source or not self.newest_ns:
            if self.newest_ns and own[1] == self._own[1]:
                turned_rad = difference(own[0], self._own[0])
                self._told[source] = wrap(self._yaw_rad + turned_rad - read_rad), self._count
            else:
                self._count += 1
                self._told[source] = 0.0, self._count
        self._yaw_rad = wrap(read_rad + self._told[source][0])
        self._source, self._own, self.newest_ns = source, own, stamp_ns

"""Publishes odometry and IMU samples of one vehicle.

The autopilot's position, height and heading are our own estimate sent back, and are never published. Its velocity is
partly ours: it is published with an inflated covariance, more so if the autopilot or the cameras doubt it. Its heading
is replaced by integrated gyro rates, whose increments are its own measurement (docs/explanation/estimation.md 8).
"""

from drivers.mavlink.convert import BaseAttitude, attitude_quaternion
from drivers.mavlink.settings import VehicleSettings
from drivers.mavlink.turning import heading_rate_rad_s, lasting_s
from drivers.mavlink.uncertainty import StatedUncertainty
from drivers.plausibility.health import ALL_GOOD, SUSPECT_VELOCITY_STD_M_S, Health, HealthReport, Sensor
from groundstation.bus.api import Bus
from groundstation.bus.messages import ImuSample, Odometry, Vector3
from groundstation.bus.topics import IMU, ODOMETRY
from groundstation.geometry.angles import wrap
from groundstation.time_units import NS_PER_S

_GAP_S = 0.5
_CLIMB_SHARE = 1.5


class GyroHeading:
    """Heading by integrated turn rates, from 0; `resets` rises where a gap makes the increment void.

    It begins at the time of the first sample in seconds: another process, after a restart, has another 0.
    """

    def __init__(self) -> None:
        self.yaw_rad = 0.0
        self.resets = 0
        self._stamp_ns: int | None = None
        self._rate_rad_s = 0.0

    def update(self, stamp_ns: int, attitude: BaseAttitude) -> None:
        """Take the turn rate of a sample."""
        rate = heading_rate_rad_s(attitude)
        if self._stamp_ns is None:
            self.resets = stamp_ns // NS_PER_S
        else:
            elapsed_s = (stamp_ns - self._stamp_ns) * 1e-9
            if elapsed_s > _GAP_S:
                self.resets += 1
            else:
                self.yaw_rad = wrap(self.yaw_rad + 0.5 * (rate + self._rate_rad_s) * elapsed_s)
        self._stamp_ns, self._rate_rad_s = stamp_ns, rate

    def at(self, stamp_ns: int) -> float:
        """Return the heading, shortly after the last sample [rad]."""
        if self._stamp_ns is None:
            return self.yaw_rad
        return wrap(self.yaw_rad + lasting_s(stamp_ns - self._stamp_ns) * self._rate_rad_s)


class TelemetryPublisher:
    """Turns telemetry into bus messages, stamped with its receipt."""

    def __init__(self, settings: VehicleSettings, bus: Bus) -> None:
        self._name, self._bus = settings.name, bus
        self._heading = GyroHeading()
        self.stated = StatedUncertainty()
        self._velocity_std_m_s, self._attitude_std_rad = settings.velocity_std_m_s, settings.attitude_std_rad

    def attitude(self, stamp_ns: int, attitude: BaseAttitude) -> None:
        """Take an attitude: its turn rate moves the heading."""
        self._heading.update(stamp_ns, attitude)

    def velocity(
        self, stamp_ns: int, velocity_m_s: Vector3, attitude: BaseAttitude, health: HealthReport = ALL_GOOD
    ) -> None:
        """Publish a velocity [base_stabilized] unless it is BAD."""
        believed = health.of(Sensor.TELEMETRY, Sensor.CLOCK, Sensor.VELOCITY)
        if believed is Health.BAD or health.withheld:
            return
        std_m_s = max(self._velocity_std_m_s, self.stated.velocity_std_m_s(stamp_ns))
        if believed is Health.SUSPECT:
            std_m_s = max(std_m_s, SUSPECT_VELOCITY_STD_M_S)
        message = Odometry(
            header=self._bus.header(self._name, stamp_ns),
            velocity_m_s=velocity_m_s,
            velocity_covariance=_covariance(std_m_s, self.stated.climb_std_m_s(stamp_ns)),
            yaw_rad=self._heading.at(stamp_ns),
            roll_rad=attitude.roll_rad,
            pitch_rad=attitude.pitch_rad,
            attitude_std_rad=max(self._attitude_std_rad, self.stated.attitude_std_rad(stamp_ns)),
            reset=self._heading.resets,
        )
        self._bus.publish(ODOMETRY, message)

    def imu(self, stamp_ns: int, rates: Vector3, force: Vector3, attitude: BaseAttitude | None) -> None:
        """Publish rates and specific force [base]."""
        sample = ImuSample(
            header=self._bus.header(self._name, stamp_ns),
            angular_velocity_rad_s=rates,
            specific_force_m_s2=force,
            attitude=None if attitude is None else attitude_quaternion(attitude),
        )
        self._bus.publish(IMU, sample)


def _covariance(std_m_s: float, climb_std_m_s: float) -> tuple[float, ...]:
    horizontal, vertical = std_m_s**2, max(std_m_s * _CLIMB_SHARE, climb_std_m_s) ** 2
    return (horizontal, 0.0, 0.0, 0.0, horizontal, 0.0, 0.0, 0.0, vertical)

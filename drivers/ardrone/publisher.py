"""Publishes odometry and IMU samples, at most at the rates of the settings; of the IMU the mean since the last."""

from drivers.ardrone.convert import HeadingWatch, NavdataMotion
from drivers.ardrone.height import HeightWatch
from drivers.ardrone.packet_times import PacketTimes
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.plausibility.health import ALL_GOOD, SUSPECT_VELOCITY_STD_M_S, Health, HealthReport, Sensor
from drivers.thinning import Decimator
from groundstation.bus.api import Bus
from groundstation.bus.messages import ImuSample, Odometry, Vector3
from groundstation.bus.topics import IMU, ODOMETRY
from groundstation.geometry.angles import quaternion_from_euler

# The climb rate is the derivative of an ultrasound altitude.
_CLIMB_STD_M_S = 0.15
# It is not reported while the ultrasound receives another drone's.
_VOID_CLIMB_STD_M_S = 2.0
_NO_SUMS = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class _InertialMean:
    """Mean rates and specific force since last taken: their integral equals that of all samples."""

    def __init__(self) -> None:
        self._sums, self._count = _NO_SUMS, 0

    def add(self, rates: Vector3, force: Vector3) -> None:
        """Take a sample."""
        (wx, wy, wz), (fx, fy, fz) = rates, force
        sums = self._sums
        self._sums = (sums[0] + wx, sums[1] + wy, sums[2] + wz, sums[3] + fx, sums[4] + fy, sums[5] + fz)
        self._count += 1

    def take(self) -> tuple[Vector3, Vector3]:
        """Return (rates, force) and begin anew; at least one sample was added."""
        wx, wy, wz, fx, fy, fz = (total / self._count for total in self._sums)
        self._sums, self._count = _NO_SUMS, 0
        return (wx, wy, wz), (fx, fy, fz)


class NavdataPublisher:
    """Turns motions into messages stamped with the drone's time on our clock; the estimator accounts for the delay."""

    def __init__(self, settings: ArDroneDriverSettings, bus: Bus) -> None:
        self._name = settings.name
        self._bus = bus
        self._times, self._heading = PacketTimes(), HeadingWatch()
        self.heights = HeightWatch()
        self._odometry = Decimator(settings.odometry_hz)
        self._imu, self._inertial = Decimator(settings.imu_hz), _InertialMean()
        self._covariances = {
            (suspect, sound): (std**2, 0.0, 0.0, 0.0, std**2, 0.0, 0.0, 0.0, climb_std**2)
            for suspect, std in ((False, settings.velocity_std_m_s), (True, SUSPECT_VELOCITY_STD_M_S))
            for sound, climb_std in ((True, _CLIMB_STD_M_S), (False, _VOID_CLIMB_STD_M_S))
        }

    def would_be_due(self, stamp_ns: int) -> bool:
        """Return whether a motion at that time would be published."""
        return self._odometry.would_be_due(stamp_ns) or self._imu.would_be_due(stamp_ns)

    def publish(
        self, arrival_ns: int, motion: NavdataMotion, health: HealthReport = ALL_GOOD, drone_ns: int | None = None
    ) -> None:
        """Publish due data that is not BAD; all motions are checked for jumps of the heading.

        drone_ns: time of the motion [drone].
        """
        stamp_ns = self._times.date(arrival_ns, drone_ns)
        reset = self._heading.update(stamp_ns, motion)
        sound = motion.height_m is None or self.heights.accept(stamp_ns, motion.height_m)
        all_values = health.of(Sensor.TELEMETRY, Sensor.CLOCK)
        velocity = max(all_values, health.of(Sensor.VELOCITY))
        if velocity < Health.BAD and not health.withheld and self._odometry.is_due(stamp_ns):
            covariance = self._covariances[velocity is Health.SUSPECT, sound]
            self._bus.publish(ODOMETRY, self._odometry_message(stamp_ns, motion, reset, sound, covariance))
        if max(all_values, health.of(Sensor.IMU)) is Health.BAD:
            return
        if motion.rates_rad_s is not None and motion.specific_force_m_s2 is not None:
            self._inertial.add(motion.rates_rad_s, motion.specific_force_m_s2)
            if self._imu.is_due(stamp_ns):
                self._bus.publish(IMU, self._imu_message(stamp_ns, motion))

    def _imu_message(self, stamp_ns: int, motion: NavdataMotion) -> ImuSample:
        rates, force = self._inertial.take()
        return ImuSample(
            header=self._bus.header(self._name, stamp_ns),
            angular_velocity_rad_s=rates,
            specific_force_m_s2=force,
            attitude=quaternion_from_euler(motion.roll_rad, motion.pitch_rad, motion.yaw_rad),
        )

    def _odometry_message(
        self, stamp_ns: int, motion: NavdataMotion, reset: int, sound: bool, covariance: tuple[float, ...]
    ) -> Odometry:
        return Odometry(
            header=self._bus.header(self._name, stamp_ns),
            velocity_m_s=motion.velocity_m_s,
            velocity_covariance=covariance,
            yaw_rad=motion.yaw_rad,
            roll_rad=motion.roll_rad,
            pitch_rad=motion.pitch_rad,
            height_m=motion.height_m if sound else None,
            reset=reset,
        )

"""Telemetry of an emulated autopilot in MAVLink's units and frames, independent of the driver's conversions.

World and body are x forward, y left, z up; MAVLink wants north-east-down and forward-right-down, yaw clockwise.
"""

import math
from collections.abc import Callable

from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.flight import OdometryMessage
from drivers.mavlink.wire.frames import Message
from drivers.mavlink.wire.names import QUADROTOR, EkfFlag, Flavour, SensorBits
from drivers.mavlink.wire.positioning import GlobalPositionInt, GpsRawInt
from groundstation.geometry.angles import quaternion_from_euler
from sim_bridge.devices.mavlink_ardupilot import ArduCopter
from sim_bridge.devices.mavlink_firmware import AutopilotFirmware
from sim_bridge.world.airframe import STANDING_HEIGHT_M
from sim_bridge.world.mavlink_estimator import InertialEstimate
from sim_bridge.world.readings import Readings
from sim_bridge.world.world import TICK_NS
from sim_bridge.wrong_values import WrongValues

_MG = 1000.0 / 9.80665
_NO_CELL = _UNKNOWN = 65535
_VOLTS_EMPTY, _VOLTS_SPAN = 14.0, 2.8
_POSITION_VARIANCE = 0.01  # as an autopilot states it [m^2]
_SMALL_RATIO = 0.05
# WIRE (PX4 1.16, source): the times without any pose, and without one that it fused, after which a PX4 navigates by its
# inertial sensors alone.
_FED_S, _AIDED_S = 0.4, 1.0


class Speaker:
    """Builds the messages of one vehicle; reported: values under a fault, instead of its estimate."""

    def __init__(self, firmware: AutopilotFirmware) -> None:
        self._firmware = firmware
        self._copter, self._honest = firmware.copter, firmware.copter.estimate
        self.reported: Readings | None = None
        self.boot_us = 0
        self.builders: dict[type[Message], Callable[[], Message | None]] = {
            t.Heartbeat: self.heartbeat,
            t.SysStatus: self.sys_status,
            t.ExtendedSysState: self.extended,
            t.LocalPositionNed: self.local_position,
            t.Attitude: self.attitude,
            t.AttitudeQuaternion: self.quaternion,
            t.HighresImu: self.highres_imu,
            t.RawImu: self.raw_imu,
            t.BatteryStatus: self.battery,
            t.HomePosition: self.home,
            t.GpsGlobalOrigin: self.origin,
            t.AutopilotVersion: self.version,
            GpsRawInt: self.gps,
            GlobalPositionInt: self.global_position,
        }
        if firmware.flavour is Flavour.PX4:
            self.builders |= {OdometryMessage: self.odometry, t.EstimatorStatus: self.estimator_status}
        else:
            self.builders[t.EkfStatusReport] = self.ekf

    def honest(self) -> Readings:
        """Return the vehicle's present estimate, as a value."""
        e, ticks = self._honest, self.boot_us * 1000 // TICK_NS
        readings = (e.velocity, e.roll, e.pitch, e.yaw, e.gyros, e.accelerometers, self._copter.battery)
        return Readings(ticks, *readings, position=e.position, status=self._status)

    def report(self, now_s: float, wrong: WrongValues) -> None:
        """Pass the readings of a tick through its faults."""
        self.reported = None
        self.reported = wrong.report(now_s, self.honest())
        self.boot_us = self.reported.ticks * TICK_NS // 1000

    @property
    def _estimate(self) -> InertialEstimate | Readings:
        return self.reported or self._honest

    @property
    def _battery(self) -> float:
        return (self.reported or self._copter).battery

    @property
    def _status(self) -> tuple[bool, int, int, bool]:
        if self.reported is not None:
            armed, mode, landed, airborne = self.reported.status
            return armed, mode, landed, airborne
        firmware = self._firmware
        return firmware.armed, firmware.mode, firmware.landed, self._copter.airborne

    @property
    def boot_ms(self) -> int:
        """Return the time since power-on [ms]."""
        return self.boot_us // 1000 % (1 << 32)

    def heartbeat(self) -> Message:
        """Return its type, flavour and mode."""
        armed, mode, _, airborne = self._status
        base = 1 | (128 if armed else 0)
        state = self._firmware.state(armed, airborne)
        return t.Heartbeat(QUADROTOR, self._firmware.flavour, base, mode, state)

    def sys_status(self) -> Message:
        """Return health and battery."""
        healthy = SensorBits.GYRO | SensorBits.ACCELEROMETER | SensorBits.MAGNETOMETER
        if self._firmware.located:
            healthy |= SensorBits.VISION_POSITION
        if self._firmware.global_position:
            healthy |= SensorBits.GPS
        if self._firmware.hears_transmitter:
            healthy |= SensorBits.RC_RECEIVER
        ardupilot = isinstance(self._firmware, ArduCopter)
        if self._firmware.passes_checks:
            healthy |= SensorBits.PREARM_CHECK
        present = healthy | SensorBits.VISION_POSITION | SensorBits.PREARM_CHECK
        if ardupilot:
            present |= SensorBits.RC_RECEIVER if self._firmware.received else 0
            # WIRE (ArduPilot, GCS.cpp): a fence that does not exist is healthy; else MAVProxy reports a breach.
            healthy |= SensorBits.GEOFENCE
        else:
            # WIRE (PX4 1.16): a sensor that is not present counts as healthy.
            healthy |= SensorBits.RC_RECEIVER
        return t.SysStatus(present, present, healthy, 300, self._millivolts, 500, self._percent)

    @property
    def _percent(self) -> int:
        return round(100 * self._battery)

    @property
    def _millivolts(self) -> int:
        return round(1000 * (_VOLTS_EMPTY + _VOLTS_SPAN * self._battery))

    def extended(self) -> Message:
        """Return the landed state."""
        return t.ExtendedSysState(0, self._status[2])

    def local_position(self) -> Message | None:
        """Return its estimated position; a PX4 tells one without having any (docs/reference/mavlink.md 2.2)."""
        if not self._honest.has_position and self._firmware.flavour is Flavour.ARDUPILOT:
            return None
        (x, y, z), (vx, vy, vz) = self._estimate.position, self._estimate.velocity
        return t.LocalPositionNed(self.boot_ms, x, -y, -z, vx, -vy, -vz)

    def _rates(self) -> tuple[float, float, float]:
        wx, wy, wz = self._estimate.gyros
        return wx, -wy, -wz

    def attitude(self) -> Message:
        """Return its attitude as angles."""
        e = self._estimate
        return t.Attitude(self.boot_ms, e.roll, -e.pitch, -e.yaw, *self._rates())

    def _quaternion(self) -> tuple[float, float, float, float]:
        e = self._estimate
        return quaternion_from_euler(e.roll, -e.pitch, -e.yaw)

    def quaternion(self) -> Message:
        """Return its attitude as a quaternion."""
        return t.AttitudeQuaternion(self.boot_ms, *self._quaternion(), *self._rates())

    def highres_imu(self) -> Message:
        """Return its inertial sensors in SI units."""
        fx, fy, fz = self._estimate.accelerometers
        return t.HighresImu(self.boot_us, fx, -fy, -fz, *self._rates())

    def raw_imu(self) -> Message:
        """Return its inertial sensors in mG and mrad/s."""
        fx, fy, fz = self._estimate.accelerometers
        force = (_whole(fx * _MG), _whole(-fy * _MG), _whole(-fz * _MG))
        wx, wy, wz = self._rates()
        return t.RawImu(self.boot_us, *force, _whole(wx * 1000), _whole(wy * 1000), _whole(wz * 1000))

    def odometry(self) -> Message | None:
        """WIRE (docs/reference/mavlink.md 2): PX4 sends its velocity in NED, marked by child frame 1."""
        if not self._honest.has_position:
            return None
        (x, y, z), (vx, vy, vz) = self._estimate.position, self._estimate.velocity
        # As confident as a real one, however wrong it is (docs/reference/mavlink.md 2.1): 0.3 degrees, 0.05 m/s.
        pose = _diagonal(*(_POSITION_VARIANCE,) * 3, 2.7e-5, 2.7e-5, 0.003)
        velocity = _diagonal(0.0025, 0.0025, 0.0025, 0.0, 0.0, 0.0)
        q = self._quaternion()
        return OdometryMessage(self.boot_us, 1, 1, x, -y, -z, q, vx, -vy, -vz, *self._rates(), pose, velocity, 0, 8, 0)

    def battery(self) -> Message:
        """Return the battery."""
        cells = (self._millivolts, *(_NO_CELL,) * 9)
        return t.BatteryStatus(0, 0, 3, 32767, cells, 500, -1, -1, self._percent)

    @property
    def _solution(self) -> EkfFlag:
        flags = EkfFlag.ATTITUDE | EkfFlag.VELOCITY_VERT | EkfFlag.POS_VERT_ABS
        if not self._firmware.located:
            return flags | EkfFlag.CONST_POS_MODE
        flags |= EkfFlag.VELOCITY_HORIZ | EkfFlag.POS_HORIZ_REL | EkfFlag.POS_HORIZ_ABS
        return flags | EkfFlag.PRED_POS_HORIZ_REL | EkfFlag.PRED_POS_HORIZ_ABS

    def ekf(self) -> Message:
        """Return the flags and test ratios of its estimator (ArduPilot)."""
        ratio = self._honest.test_ratio
        return t.EkfStatusReport(self._solution, _SMALL_RATIO, ratio, ratio, 0.0, 0.0)

    def estimator_status(self) -> Message:
        """Return the flags, test ratios and accuracies of its estimator (PX4).

        WIRE (docs/reference/mavlink.md 2.2): NaN is the ratio of what it is not fed.
        """
        ratio, accuracy = self._honest.test_ratio, math.sqrt(_POSITION_VARIANCE)
        velocity = _SMALL_RATIO if self._firmware.global_position else math.nan
        fed = ratio if self._is_fed else math.nan
        flags = self._px4_solution
        return t.EstimatorStatus(self.boot_us, flags, velocity, fed, ratio, 0.0, 0.0, 0.0, accuracy, accuracy)

    @property
    def _is_fed(self) -> bool:
        return self._honest.has_position and self._honest.fed_s < _FED_S

    @property
    def _px4_solution(self) -> EkfFlag:
        flags = EkfFlag.ATTITUDE | EkfFlag.VELOCITY_VERT | EkfFlag.POS_VERT_ABS
        if not self._copter.airborne:
            flags |= EkfFlag.CONST_POS_MODE  # it stands, with or without a position
        inertial_s = max(self._honest.fed_s - _FED_S, self._honest.aided_s - _AIDED_S)
        allowed_s = self._firmware.parameters["EKF2_NOAID_TOUT"] * 1e-6 - _AIDED_S
        if self._honest.has_position and inertial_s < max(0.0, allowed_s):
            flags |= EkfFlag.VELOCITY_HORIZ | EkfFlag.POS_HORIZ_REL
            if self._firmware.origin is not None:
                flags |= EkfFlag.POS_HORIZ_ABS
        if self._is_fed:
            flags |= EkfFlag.PRED_POS_HORIZ_REL
        return flags | EkfFlag.PRED_POS_HORIZ_ABS if self._firmware.global_position else flags

    def home(self) -> Message | None:
        """Return its place of take-off, once it has an origin."""
        origin = self._firmware.origin
        return origin and t.HomePosition(*origin, 0.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, self.boot_us)

    def origin(self) -> Message | None:
        """Return the estimator's origin, once it has one."""
        origin = self._firmware.origin
        return origin and t.GpsGlobalOrigin(*origin, self.boot_us)

    def gps(self) -> Message:
        """Return the state of its satellite receiver: none, or a fix."""
        satellites = self._firmware.satellites
        if satellites is None:
            return GpsRawInt(self.boot_us, 0, 0, 0, 0, _UNKNOWN, _UNKNOWN, _UNKNOWN, _UNKNOWN, 255)
        x, y, z = self._estimate.position
        place = (*satellites.degrees(x, y), satellites.altitude_mm(z))
        speed = math.hypot(*self._estimate.velocity[:2])
        return GpsRawInt(self.boot_us, 3, *place, 90, 120, round(100 * speed), _UNKNOWN, 12)

    def global_position(self) -> Message | None:
        """Return its estimated position on Earth, if it flies by satellites."""
        satellites = self._firmware.satellites
        if satellites is None or not self._firmware.global_position:
            return None
        (x, y, z), (vx, vy, vz) = self._estimate.position, self._estimate.velocity
        place = (*satellites.degrees(x, y), satellites.altitude_mm(z), round(1000 * (z - STANDING_HEIGHT_M)))
        velocity = (_whole(100 * vx), _whole(-100 * vy), _whole(-100 * vz))
        return GlobalPositionInt(
            self.boot_ms, *place, *velocity, round(math.degrees(-self._estimate.yaw) * 100) % 36000
        )

    def version(self) -> Message:
        """Return its capabilities: MISSION_INT, COMMAND_INT, SET_POSITION_TARGET, MAVLINK2, parameter encoding."""
        px4 = self._firmware.flavour is Flavour.PX4
        capabilities = 4 | 8 | 128 | 8192 | (16 if px4 else 131072)
        version = 0x011000FF if px4 else 0x040602FF
        return t.AutopilotVersion(capabilities, version)


def _diagonal(*values: float) -> tuple[float, ...]:
    triangle = [0.0] * 21
    for place, value in zip((0, 6, 11, 15, 18, 20), values, strict=True):
        triangle[place] = value
    return tuple(triangle)


def _whole(value: float) -> int:
    return max(-32768, min(32767, round(value)))

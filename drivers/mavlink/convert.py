"""Units and frames: MAVLink telemetry to bus messages, our velocities and poses to MAVLink messages.

WIRE (docs/reference/mavlink.md 5.1): NED and FRD, yaw clockwise. Since the autopilot's heading comes from our estimate,
its local NED is the world turned by 180 degrees about x: north = world x, east = -y, down = -z.
"""

import math
from dataclasses import dataclass

from drivers.mavlink.settings import FASTEST_M_S
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.flight import OdometryMessage, SetPositionTargetLocalNed, VisionPositionEstimate
from drivers.mavlink.wire.names import (
    ARMED,
    AUTOPILOT_COMPONENT,
    ESTIMATOR_VISION,
    VELOCITY_AND_YAW_RATE,
    Flavour,
    Landed,
    MavFrame,
    MavState,
    land_mode,
)
from drivers.mavlink.wire.telemetry import AttitudeQuaternion, HighresImu, LocalPositionNed, RawImu
from drivers.plausibility.limits import PlausibilityLimits
from drivers.plausibility.motion import MotionSample
from drivers.vehicle_settings import VehicleLimits
from groundstation.bus.messages import FlightState, Quaternion, Vector3
from groundstation.geometry.angles import euler_from_quaternion, quaternion_from_euler, wrap
from groundstation.geometry.stabilized_frame import STANDARD_GRAVITY_M_S2

_M_S2_FROM_MG = STANDARD_GRAVITY_M_S2 / 1000
_RAD_S_FROM_MRAD_S = 0.001
# Values beyond these are no measurement of an indoor vehicle.
_MOST_M_S, _MOST_RAD_S, _MOST_M_S2, _MOST_M = 30.0, 60.0, 400.0, 10_000.0
_STILL_M_S = 0.15
# An estimator may be reset once, by the first position that it gets; time_boot_ms wraps after 49 days.
LIMITS = PlausibilityLimits(speed_m_s=FASTEST_M_S, tilt_rad=math.radians(50.0), jump_m_s=0.6)


@dataclass(frozen=True, slots=True)
class BaseAttitude:
    """Euler angles [rad; FLU, intrinsic z-y-x] and body rates [rad/s; base]."""

    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    rates_rad_s: Vector3


@dataclass(frozen=True, slots=True)
class VisionPose:
    """The belief about a vehicle [world, FLU]: position, heading, their variances, velocity, time [ns]."""

    stamp_ns: int
    position_m: Vector3
    yaw_rad: float
    variances: tuple[float, float, float, float]
    velocity_m_s: Vector3


def _sane(what: str, limit: float, *values: float) -> None:
    # Comparisons with NaN are false: one test rejects NaN together with values that are too large.
    if not all(-limit <= value <= limit for value in values):
        finite = all(map(math.isfinite, values))
        raise WireError("implausible" if finite else "not_finite", f"{what} {values}")


def attitude_from_quaternion(message: AttitudeQuaternion) -> BaseAttitude:
    """Return the attitude; raises WireError unless the quaternion is one."""
    w, x, y, z = message.q1, message.q2, message.q3, message.q4
    norm2 = w * w + x * x + y * y + z * z
    if not 0.9 < norm2 < 1.1:
        raise WireError("implausible" if math.isfinite(norm2) else "not_finite", "quaternion")
    rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
    _sane("body rates", _MOST_RAD_S, *rates)
    norm = math.sqrt(norm2)
    roll, pitch, yaw = euler_from_quaternion((w / norm, x / norm, y / norm, z / norm))
    return BaseAttitude(roll, -pitch, wrap(-yaw), (rates[0], -rates[1], -rates[2]))


def velocity_from_local(message: LocalPositionNed, attitude: BaseAttitude) -> Vector3:
    """Return the estimated velocity [m/s; base_stabilized]; raises WireError."""
    north, east, down = message.vx, message.vy, message.vz
    _sane("velocity", _MOST_M_S, north, east, down)
    c, s = math.cos(attitude.yaw_rad), math.sin(attitude.yaw_rad)
    x, y = north, -east
    return c * x + s * y, c * y - s * x, -down


def sample_from_local(
    stamp_ns: int, message: LocalPositionNed, attitude: BaseAttitude, inertial: tuple[float, ...]
) -> MotionSample:
    """Return the input of a velocity's plausibility check, in the axes of the message, in which it may stand still."""
    tilt = (attitude.roll_rad, attitude.pitch_rad)
    return MotionSample(
        stamp_ns,
        (message.vx, -message.vy),
        *tilt,
        inertial,
        message.time_boot_ms * 1_000_000,
        attitude.yaw_rad,
        -message.vz,
    )


def position_from_local(message: LocalPositionNed) -> Vector3:
    """Return the estimated position [m; the frame of our poses]: for the driver's own use only, never to be fused."""
    _sane("position", _MOST_M, message.x, message.y, message.z)
    return message.x, -message.y, -message.z


def imu_from_highres(message: HighresImu) -> tuple[Vector3, Vector3]:
    """Return (rates [rad/s], specific force [m/s^2]) in base; raises WireError."""
    _sane("rates", _MOST_RAD_S, message.xgyro, message.ygyro, message.zgyro)
    _sane("specific force", _MOST_M_S2, message.xacc, message.yacc, message.zacc)
    return (message.xgyro, -message.ygyro, -message.zgyro), (message.xacc, -message.yacc, -message.zacc)


def imu_from_raw(message: RawImu) -> tuple[Vector3, Vector3]:
    """Return (rates [rad/s], specific force [m/s^2]) of RAW_IMU, whose units are mrad/s and mG."""
    g, a = _RAD_S_FROM_MRAD_S, _M_S2_FROM_MG
    rates = (message.xgyro * g, -message.ygyro * g, -message.zgyro * g)
    return rates, (message.xacc * a, -message.yacc * a, -message.zacc * a)


def flight_state_from(flavour: Flavour, base_mode: int, custom_mode: int, status: int, landed: int) -> FlightState:
    """Return the vehicle's flight state. status: MAV_STATE; landed: MAV_LANDED_STATE.

    A vehicle in the air is FLYING even while it climbs to its take-off height: from then on cameras may see it.
    """
    if not base_mode & ARMED:
        return FlightState.LANDED
    if status >= MavState.POWEROFF:
        return FlightState.EMERGENCY
    # WIRE (docs/reference/mavlink.md 5.2): a vehicle in an emergency lands by itself: its motors must not be cut for
    # that.
    lands = custom_mode == land_mode(flavour) or status == MavState.EMERGENCY
    if landed == Landed.LANDING or (landed == Landed.IN_AIR and lands):
        return FlightState.LANDING
    if landed == Landed.IN_AIR:
        return FlightState.FLYING
    if landed == Landed.TAKE_OFF:
        return FlightState.TAKING_OFF
    # On the floor, motors still turning after a landing: not landed until they stop.
    return FlightState.LANDING if custom_mode == land_mode(flavour) else FlightState.LANDED


def is_still(velocity_m_s: Vector3) -> bool:
    """Return whether a flying vehicle hovers."""
    return math.hypot(*velocity_m_s) < _STILL_M_S


def setpoint_from_velocity(
    system: int, now_ns: int, velocity_m_s: Vector3, yaw_rate_rad_s: float, limits: VehicleLimits,
    drift_m_s: Vector3 = (0.0, 0.0, 0.0),
) -> SetPositionTargetLocalNed:  # fmt: skip
    """Return the setpoint of a velocity [base_stabilized, FLU], clamped to the limits.

    drift_m_s: error of the vehicle's own velocity, added beyond the limits, because they apply to the true velocity.
    """
    (forward, left, up), turn = limits.within(velocity_m_s, yaw_rate_rad_s)
    return SetPositionTargetLocalNed(
        time_boot_ms=now_ns // 1_000_000 % (1 << 32),
        target_system=system,
        target_component=AUTOPILOT_COMPONENT,
        coordinate_frame=MavFrame.BODY_NED,
        type_mask=VELOCITY_AND_YAW_RATE,
        x=0.0, y=0.0, z=0.0,
        vx=forward + drift_m_s[0], vy=-(left + drift_m_s[1]), vz=-(up + drift_m_s[2]),
        afx=0.0, afy=0.0, afz=0.0,
        yaw=0.0, yaw_rate=-turn,
    )  # fmt: skip


def _upper(diagonal: tuple[float, ...]) -> tuple[float, ...]:
    size = len(diagonal)
    return tuple(diagonal[row] if row == column else 0.0 for row in range(size) for column in range(row, size))


_TILT_VARIANCE = math.radians(3.0) ** 2


def vision_from_pose(pose: VisionPose, attitude: BaseAttitude, resets: int) -> VisionPositionEstimate:
    """Return the pose in the form that both flavours accept; roll and pitch are the vehicle's own."""
    x, y, z = pose.position_m
    vx, vy, vz, vyaw = pose.variances
    return VisionPositionEstimate(
        usec=pose.stamp_ns // 1000,
        x=x, y=-y, z=-z,
        roll=attitude.roll_rad, pitch=-attitude.pitch_rad, yaw=wrap(-pose.yaw_rad),
        covariance=_upper((vx, vy, vz, _TILT_VARIANCE, _TILT_VARIANCE, vyaw)),
        reset_counter=resets % 256,
    )  # fmt: skip


# MAVSDK refuses NaN, so an unknown velocity gets a variance that makes it worthless [m^2/s^2].
_UNKNOWN_VARIANCE = 1e4


def odometry_from_pose(pose: VisionPose, attitude: BaseAttitude, resets: int) -> OdometryMessage:
    """Return the pose in the form best for PX4: frame NED, child body FRD; the velocity counts as unknown.

    Our velocity would be the autopilot's own, late and scaled; it differentiates our positions itself.
    """
    x, y, z = pose.position_m
    vx, vy, vz, vyaw = pose.variances
    c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    forward, left = (
        c * pose.velocity_m_s[0] + s * pose.velocity_m_s[1],
        c * pose.velocity_m_s[1] - s * pose.velocity_m_s[0],
    )
    return OdometryMessage(
        time_usec=pose.stamp_ns // 1000,
        frame_id=MavFrame.LOCAL_NED,
        child_frame_id=MavFrame.BODY_FRD,
        x=x, y=-y, z=-z,
        q=quaternion_from_euler(attitude.roll_rad, -attitude.pitch_rad, -pose.yaw_rad),
        vx=forward, vy=-left, vz=-pose.velocity_m_s[2],
        rollspeed=attitude.rates_rad_s[0], pitchspeed=-attitude.rates_rad_s[1], yawspeed=-attitude.rates_rad_s[2],
        pose_covariance=_upper((vx, vy, vz, _TILT_VARIANCE, _TILT_VARIANCE, vyaw)),
        velocity_covariance=_upper((_UNKNOWN_VARIANCE,) * 6),
        reset_counter=resets % 256,
        estimator_type=ESTIMATOR_VISION,
        quality=100,
    )  # fmt: skip


def attitude_quaternion(attitude: BaseAttitude) -> Quaternion:
    """Return wxyz of odom from base [FLU]."""
    return quaternion_from_euler(attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad)

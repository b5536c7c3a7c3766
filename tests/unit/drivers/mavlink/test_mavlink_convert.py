"""Signs and units of MAVLink, written out by hand; a drone that flies the wrong way is a sign error here."""

import math

import pytest

from drivers.mavlink import convert
from drivers.mavlink.convert import BaseAttitude, VisionPose
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.telemetry import AttitudeQuaternion, HighresImu, LocalPositionNed, RawImu
from drivers.vehicle_settings import VehicleLimits

H = math.sqrt(0.5)
LEVEL = BaseAttitude(0.0, 0.0, 0.0, (0.0, 0.0, 0.0))


def test_heading_east_is_a_right_turn():
    # 90 degrees clockwise about down.
    attitude = convert.attitude_from_quaternion(AttitudeQuaternion(0, H, 0, 0, H, 0.1, 0.2, 0.3))
    assert attitude.yaw_rad == pytest.approx(-math.pi / 2)
    assert attitude.rates_rad_s == pytest.approx((0.1, -0.2, -0.3))


def test_nose_up_is_negative_pitch_and_right_side_down_positive_roll():
    up = convert.attitude_from_quaternion(AttitudeQuaternion(0, math.cos(0.1), 0, math.sin(0.1), 0, 0, 0, 0))
    assert up.pitch_rad == pytest.approx(-0.2)
    right = convert.attitude_from_quaternion(AttitudeQuaternion(0, math.cos(0.1), math.sin(0.1), 0, 0, 0, 0, 0))
    assert right.roll_rad == pytest.approx(0.2)


def test_velocity_is_turned_into_the_heading():
    # Nose to the east (world -y), flying north (world x): to its left.
    east = BaseAttitude(0.0, 0.0, -math.pi / 2, (0.0, 0.0, 0.0))
    velocity = convert.velocity_from_local(LocalPositionNed(0, 0, 0, 0, 1.0, 0.0, -0.5), east)
    assert velocity == pytest.approx((0.0, 1.0, 0.5))
    assert convert.position_from_local(LocalPositionNed(0, 1.0, 2.0, -3.0, 0, 0, 0)) == (1.0, -2.0, 3.0)


def test_imu_at_rest_feels_gravity_upwards():
    _, force = convert.imu_from_highres(HighresImu(0, 0.0, 0.0, -9.81, 0.1, 0.2, 0.3))
    assert force == pytest.approx((0.0, 0.0, 9.81))
    rates, force = convert.imu_from_raw(RawImu(0, 100, 200, -1000, 10, 20, 30))
    assert force == pytest.approx((0.980665, -1.96133, 9.80665))
    assert rates == pytest.approx((0.01, -0.02, -0.03))


def test_setpoint_signs_mask_and_clamps():
    s = convert.setpoint_from_velocity(11, 5_000_000, (0.3, 0.2, 0.1), 0.5, VehicleLimits())
    assert (s.vx, s.vy, s.vz, s.yaw_rate) == pytest.approx((0.3, -0.2, -0.1, -0.5))
    assert (s.coordinate_frame, s.type_mask, s.target_system) == (8, 0b010111000111, 11)
    s = convert.setpoint_from_velocity(11, 0, (3.0, -4.0, -9.0), 9.0, VehicleLimits(max_speed_m_s=0.5))
    assert (s.vx, s.vy, s.vz) == pytest.approx((0.3, 0.4, 0.4))


def test_pose_becomes_ned():
    pose = VisionPose(2_000_000, (1.0, 2.0, 3.0), 0.5, (0.1, 0.2, 0.3, 0.4), (1.0, 0.0, 0.25))
    vision = convert.vision_from_pose(pose, BaseAttitude(0.1, 0.2, 9.0, (0.0, 0.0, 0.0)), 257)
    assert (vision.usec, vision.x, vision.y, vision.z) == (2000, 1.0, -2.0, -3.0)
    assert (vision.roll, vision.pitch, vision.yaw) == (0.1, -0.2, -0.5)
    assert vision.reset_counter == 1
    assert [vision.covariance[i] for i in (0, 6, 11, 20)] == [0.1, 0.2, 0.3, 0.4]
    odometry = convert.odometry_from_pose(pose, LEVEL, 0)
    assert (odometry.frame_id, odometry.child_frame_id) == (1, 12)
    assert odometry.q == pytest.approx((math.cos(0.25), 0.0, 0.0, -math.sin(0.25)))
    assert (odometry.vx, odometry.vy, odometry.vz) == pytest.approx((math.cos(0.5), math.sin(0.5), -0.25))
    assert odometry.velocity_covariance[0] >= 1000
    assert all(map(math.isfinite, (*odometry.pose_covariance, *odometry.velocity_covariance, odometry.vx)))


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e9])
def test_nonsense_is_refused(value):
    with pytest.raises(WireError):
        convert.velocity_from_local(LocalPositionNed(0, 0, 0, 0, value, 0, 0), LEVEL)
    with pytest.raises(WireError):
        convert.imu_from_highres(HighresImu(0, value, 0, 0, 0, 0, 0))
    with pytest.raises(WireError):
        convert.attitude_from_quaternion(AttitudeQuaternion(0, value, 0, 0, 0, 0, 0, 0))


@pytest.mark.parametrize(
    ("base", "mode", "status", "landed", "state"),
    [
        (1, 0, 3, 1, "LANDED"),
        (1, 0, 3, 2, "LANDED"),  # disarmed in the air: falling, motors off
        (129, 6 << 16, 4, 2, "FLYING"),
        (129, 6 << 16, 4, 3, "TAKING_OFF"),
        (129, 4 << 16 | 6 << 24, 4, 2, "LANDING"),
        (129, 4 << 16 | 6 << 24, 4, 4, "LANDING"),
        (129, 4 << 16 | 6 << 24, 4, 1, "LANDING"),
        (129, 6 << 16, 8, 2, "EMERGENCY"),
        (129, 4 << 16 | 8 << 24, 6, 2, "LANDING"),  # of itself, without a position: motors cut now would drop it
        (129, 4 << 16 | 8 << 24, 6, 1, "LANDED"),
    ],
)
def test_flight_state_of_px4(base, mode, status, landed, state):
    assert convert.flight_state_from(Flavour.PX4, base, mode, status, landed) == state


def test_landing_mode_of_ardupilot():
    assert convert.flight_state_from(Flavour.ARDUPILOT, 129, 9, 4, 2) == "LANDING"

"""Attitude from gyroscopes and accelerometers, on a vehicle with known motion; sensors as bad as real ones."""

import math

import numpy as np
import pytest

from groundstation.bus.messages import Header, ImuSample, Odometry, Vector3
from groundstation.estimation.attitude_intake import AttitudeIntake
from groundstation.estimation.gyro_bias import GyroBias
from groundstation.estimation.inertial import InertialAttitude
from groundstation.estimation.models.driven import take_heading
from groundstation.estimation.records import CondensedOdometry, EntityMemory
from groundstation.geometry.angles import difference
from groundstation.geometry.rotations import rotation_from_euler
from groundstation.geometry.stabilized_frame import STANDARD_GRAVITY_M_S2

STEP_NS, START = 10_000_000, 10**12
GAIN, BIAS = 0.92, (0.004, -0.003, 0.01)


class Vehicle:
    """A vehicle that publishes its IMU and velocity; roll, pitch, yaw and the acceleration [level axes] are set."""

    def __init__(self) -> None:
        self.attitude = InertialAttitude(velocity_scale=1.25)
        self.now, self.roll, self.pitch, self.yaw = START, 0.0, 0.0, 0.0
        self.velocity, self.bias = np.zeros(2), np.array(BIAS)
        self._rng = np.random.default_rng(7)

    def run(
        self, seconds: float, standing: bool = False, roll: float | None = None, turn: float = 0.0,
        acceleration: tuple[float, float] = (0.0, 0.0), magnetic: float = 0.0,
    ) -> None:  # fmt: skip
        """Fly on; roll: its next value, at once; turn [rad/s]; magnetic: rate of the error of its own heading."""
        rates = np.zeros(3)
        for step in range(round(seconds * 1e9) // STEP_NS):
            self.now += STEP_NS
            elapsed_s = STEP_NS / 1e9
            if step == 0 and roll is not None:
                rates, self.roll = np.array([(roll - self.roll) / elapsed_s, 0.0, 0.0]), roll
            else:
                base = rotation_from_euler(self.roll, self.pitch, 0.0)
                rates = base.T @ np.array([0.0, 0.0, turn])
            self.yaw += turn * elapsed_s
            self.velocity += np.array(acceleration) * elapsed_s
            self._publish(rates, acceleration, standing)
            own = self.yaw + magnetic * step * elapsed_s
            self.attitude.take_heading(self.now, math.remainder(own, math.tau), 0)

    def _publish(self, rates: np.ndarray, acceleration: tuple[float, float], standing: bool) -> None:
        force = rotation_from_euler(self.roll, self.pitch, 0.0).T @ np.array([*acceleration, STANDARD_GRAVITY_M_S2])
        noisy = GAIN * force + 0.05 * self._rng.standard_normal(3)
        rates = rates + self.bias + 0.003 * self._rng.standard_normal(3)
        self.attitude.take_velocity(self.now, (*(self.velocity / 1.25).tolist(), 0.0))
        self.attitude.take_imu(self.now, _three(rates), _three(noisy), standing)

    @property
    def tilt_error_deg(self) -> float:
        found = self.attitude.at(self.now)
        assert found is not None
        return math.degrees(max(abs(found.roll_rad - self.roll), abs(found.pitch_rad - self.pitch)))

    def yaw_error_deg(self, since: float) -> float:
        found = self.attitude.at(self.now)
        assert found is not None
        return math.degrees(difference(found.yaw_rad - since, self.yaw))


def _three(values: np.ndarray) -> Vector3:
    x, y, z = values.tolist()
    return x, y, z


@pytest.fixture
def flying() -> Vehicle:
    """A flying vehicle that learnt its bias in three seconds on the ground."""
    vehicle = Vehicle()
    vehicle.run(3.0, standing=True)
    return vehicle


def test_a_lean_that_nobody_tells_is_found(flying: Vehicle) -> None:
    flying.run(5.0, roll=math.radians(-8.0))
    assert flying.tilt_error_deg < 0.5
    found = flying.attitude.at(flying.now)
    assert found is not None
    assert math.degrees(found.attitude_std_rad) < 1.0


def test_a_lean_that_was_not_followed_is_found_by_the_accelerometers_alone() -> None:
    vehicle = Vehicle()
    vehicle.roll = math.radians(6.0)
    vehicle.run(1.0)
    assert vehicle.tilt_error_deg < 0.5, "the first sample says it"
    vehicle.roll = math.radians(-2.0)
    vehicle.run(16.0)
    found = vehicle.attitude.at(vehicle.now)
    assert found is not None
    assert vehicle.tilt_error_deg < math.degrees(found.attitude_std_rad), "its gyroscopes' bias is unknown, and counted"
    assert vehicle.tilt_error_deg < 1.5, "without a rate, after four times what the accelerometers take"


def test_an_acceleration_is_no_tilt(flying: Vehicle) -> None:
    for sign in (1.0, -1.0, -1.0, 1.0):
        flying.run(2.0, acceleration=(0.5 * sign, -0.7 * sign))
        assert flying.tilt_error_deg < 0.9, "0.7 m/s^2 alone look like four degrees"


def test_the_heading_follows_turns_of_a_leaning_vehicle(flying: Vehicle) -> None:
    flying.run(0.1, roll=math.radians(10.0))
    before = flying.attitude.at(flying.now)
    assert before is not None
    since = before.yaw_rad - flying.yaw
    flying.run(10.0, turn=0.5)
    flying.run(10.0, turn=-0.3)
    assert abs(flying.yaw_error_deg(since)) < 0.6
    after = flying.attitude.at(flying.now)
    assert after is not None
    # 0.1 of the integrated gyro, and in 20 s its bias may have drifted by 0.05 degrees per second.
    assert 0.2 < math.degrees(after.yaw_std_rad) < 0.3
    assert after.resets == before.resets


def test_a_vehicle_that_is_carried_teaches_no_bias() -> None:
    vehicle = Vehicle()
    vehicle.run(3.0, standing=True, turn=0.3)
    found = vehicle.attitude.at(vehicle.now)
    assert found is not None
    assert math.degrees(found.yaw_std_rad) > 2.0, "the bias is as unknown as before"


def test_a_wandering_magnetic_heading_teaches_little(flying: Vehicle) -> None:
    found = flying.attitude.at(flying.now)
    assert found is not None
    since = found.yaw_rad - flying.yaw
    flying.run(20.0, magnetic=math.radians(8.0) / 20.0)
    assert abs(flying.yaw_error_deg(since)) < 1.0, "its own heading is wrong by 8 degrees by now"


def test_without_time_on_the_ground_the_heading_teaches_the_bias_slowly() -> None:
    rng, bias, magnetic = np.random.default_rng(3), 0.0, 0.0
    learner = GyroBias()
    yaw = 0.0
    unsure = learner.yaw_std_rad
    for k in range(60):
        magnetic += math.radians(1.7) * math.sqrt(2.0) * rng.standard_normal()
        yaw += 2.0 * (0.02 - learner.rad_s[2])
        learner.take_heading(
            START + k * 2 * 10**9, math.remainder(magnetic, math.tau), math.remainder(yaw, math.tau), 0
        )
    bias = learner.rad_s[2]
    claimed = math.sqrt(learner._turn.bias_variance)
    assert abs(bias - 0.02) < 3.0 * claimed
    assert claimed < 0.5 * math.radians(0.5)
    assert learner.yaw_std_rad < 0.6 * unsure


def test_in_flight_a_fixed_camera_tells_the_bias_of_the_heading_and_accelerometers_that_of_the_tilt() -> None:
    """Joined in the air: nothing was learnt on the ground."""
    vehicle, rng = Vehicle(), np.random.default_rng(5)
    for _ in range(300):
        vehicle.run(1 / 15, turn=0.2)
        shown = vehicle.yaw + 1.0 + 0.035 * rng.standard_normal()
        vehicle.attitude.take_sight("ceiling", vehicle.now, math.remainder(shown, math.tau), 0.035**2)
    found, bias = vehicle.attitude.at(vehicle.now), vehicle.attitude._bias
    assert found is not None
    assert math.degrees(found.yaw_std_rad) < 0.4
    assert abs(bias.rad_s[2] - BIAS[2]) < 3.0 * math.sqrt(bias._turn.bias_variance) < math.radians(0.3)
    assert vehicle.tilt_error_deg < math.degrees(found.attitude_std_rad) < 0.7


def test_two_cameras_zeros_and_a_bumped_camera_do_not_look_like_bias(flying: Vehicle) -> None:
    for k in range(150):
        flying.run(1 / 15)
        for camera, zero in (("ceiling", 0.0 if k < 75 else 0.3), ("wall", -1.0)):
            flying.attitude.take_sight(camera, flying.now, math.remainder(flying.yaw + zero, math.tau), 0.035**2)
    bias = flying.attitude._bias
    assert abs(bias.rad_s[2] - BIAS[2]) < 5e-4


def test_a_gap_voids_the_increment_and_silence_has_no_attitude(flying: Vehicle) -> None:
    before = flying.attitude.at(flying.now)
    assert before is not None
    assert flying.attitude.at(flying.now + 200_000_000) is None
    flying.now += 600_000_000
    flying.run(0.1)
    after = flying.attitude.at(flying.now)
    assert after is not None
    assert after.resets == before.resets + 1
    assert after.attitude_std_rad > 3.0 * before.attitude_std_rad


def test_the_tilt_of_a_moment_ago_is_remembered(flying: Vehicle) -> None:
    flying.run(0.3, roll=math.radians(5.0))
    then = flying.now
    flying.run(0.3, roll=math.radians(-5.0))
    tilt = flying.attitude.tilt_at(then - 20_000_000)
    assert tilt is not None
    assert math.degrees(tilt[0]) == pytest.approx(5.0, abs=0.5)
    assert flying.attitude.tilt_at(START - 10**9) is None


def test_between_samples_and_just_after_the_newest_it_turns_as_the_gyroscopes_say() -> None:
    vehicle = InertialAttitude()
    rates, force = (math.radians(30.0), math.radians(-20.0), math.radians(10.0)), (0.0, 0.0, 0.0)
    for step in range(10):
        vehicle.take_imu(START + 2 * step * STEP_NS, rates, force, standing=False)
    newest, lasting_s = vehicle.at(START + 18 * STEP_NS), STEP_NS / 1e9
    assert newest is not None
    for later, turned_s in ((-STEP_NS, -lasting_s), (STEP_NS, lasting_s)):
        found = vehicle.at(START + 18 * STEP_NS + later)
        assert found is not None
        for was, now, rate in (
            (newest.roll_rad, found.roll_rad, rates[0]),
            (newest.pitch_rad, found.pitch_rad, rates[1]),
            (newest.yaw_rad, found.yaw_rad, rates[2]),
        ):
            assert now - was == pytest.approx(rate * turned_s, abs=math.radians(0.02))


def test_a_vehicle_with_a_new_battery_teaches_its_new_bias(flying: Vehicle) -> None:
    flying.run(5.0)
    flying.now += 30 * 1_000_000_000
    flying.bias = flying.bias + np.array([0.003, 0.004, 0.005])
    flying.run(3.0, standing=True)
    found = flying.attitude.at(flying.now)
    assert found is not None
    flying.yaw, since = 0.0, found.yaw_rad
    flying.run(20.0)
    assert abs(flying.yaw_error_deg(since)) < 1.5 and flying.tilt_error_deg < 0.7


def test_attitude_recovers_after_a_full_roll(flying: Vehicle) -> None:
    for _ in range(50):
        flying.now += STEP_NS
        flying.roll += math.tau / 50
        flying._publish(np.array([math.tau / 0.5, 0.0, 0.0]), (0.0, 0.0), False)
    flying.roll = 0.0
    assert flying.tilt_error_deg < 10.0
    flying.run(6.0)
    assert flying.tilt_error_deg < 2.0


def test_a_blow_is_no_gravity(flying: Vehicle) -> None:
    for _ in range(20):
        flying.now += STEP_NS
        flying.attitude.take_imu(flying.now, BIAS, (30.0, 0.0, 5.0), False)
    assert flying.tilt_error_deg < 0.5


def test_odometry_that_comes_late_counts_no_reset() -> None:
    """A message from before the last reset, received again, would void the heading's increments before and after it."""
    intake = AttitudeIntake({"drone_1": 1.0})

    def resets(at_s: float, reset: int) -> int:
        header = Header(round(at_s * 1e9), "boot", "drone_1", "drone_1", 1)
        odometry = Odometry(
            header=header, velocity_m_s=(0.0, 0.0, 0.0), velocity_covariance=(0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01),
            yaw_rad=0.0, roll_rad=0.0, pitch_rad=0.0, reset=reset,
        )  # fmt: skip
        return intake.motion(odometry, header.stamp_ns).reset

    assert resets(1.0, 0) == resets(2.0, 0)
    after = resets(3.0, 1)
    assert after != resets(2.5, 0) == resets(1.0, 0)
    assert resets(4.0, 1) == after


@pytest.mark.parametrize("resets", [0, 1])
def test_across_a_silence_the_heading_goes_on_by_the_vehicles_own_unless_that_jumped(resets: int) -> None:
    intake = AttitudeIntake({"drone_1": 1.0})
    rate, level = math.radians(40.0), (0.0, 0.0, STANDARD_GRAVITY_M_S2)

    def heard(at_s: float, reset: int) -> tuple[float, int]:
        header = Header(START + round(at_s * 1e9), "boot", "drone_1", "drone_1", 1)
        imu = ImuSample(header=header, angular_velocity_rad_s=(0.0, 0.0, rate), specific_force_m_s2=level)
        intake.imu(imu, header.stamp_ns, standing=False)
        odometry = Odometry(
            header=header, velocity_m_s=(0.0, 0.0, 0.0), velocity_covariance=(0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01),
            yaw_rad=math.remainder(1.0 + rate * at_s, math.tau), roll_rad=0.0, pitch_rad=0.0, reset=reset,
        )  # fmt: skip
        sample = intake.motion(odometry, header.stamp_ns)
        return sample.yaw_rad, sample.reset

    before = [heard(0.02 * k, 0) for k in range(50)][-1]
    after = [heard(2.2 + 0.02 * k, resets) for k in range(50)]
    assert {count - before[1] for _, count in after} == {resets}
    if not resets:
        assert math.degrees(difference(after[0][0], before[0])) == pytest.approx(40.0 * (2.2 - 0.98), abs=1.0)
    assert math.degrees(difference(after[-1][0], after[0][0])) == pytest.approx(40.0 * 0.98, abs=0.5)


@pytest.mark.parametrize(("silent_s", "unseen_s", "share"), [(0.0, 5.0, 1.0), (1.2, 5.0, 1.0), (1.2, 0.3, 0.25)])
def test_a_turn_in_a_silence_counts_from_the_last_sighting_on(silent_s: float, unseen_s: float, share: float) -> None:
    memory, told, nothing = EntityMemory.rows(1), CondensedOdometry.rows(1), CondensedOdometry.rows(1)
    nothing["newest_at"] = -1.0
    step_s = 0.02
    take_heading(told[0], memory[0], step_s)
    for _ in range(round(silent_s / step_s) - 1):
        take_heading(nothing[0], memory[0], step_s)
        assert memory["yaw_rate"][0] == 0.0
    told["newest_yaw"], told["newest_at"], memory["unseen_s"] = 0.2, 1.0, unseen_s
    take_heading(told[0], memory[0], step_s)
    assert step_s * memory["yaw_rate"][0] == pytest.approx(share * 0.2, rel=0.02)
    told["newest_yaw"] = 0.21
    take_heading(told[0], memory[0], step_s)
    assert step_s * memory["yaw_rate"][0] == pytest.approx(0.01)


def test_a_velocity_that_the_driver_doubts_is_doubted_though_the_attitude_is_not_the_vehicles() -> None:
    intake = AttitudeIntake({"drone_1": 1.0})
    for number, std_m_s in enumerate((0.05, 0.5)):
        header = Header(round((number + 1) * 1e9), "boot", "drone_1", "drone_1", 1)
        covariance = (std_m_s**2, 0, 0, 0, std_m_s**2, 0, 0, 0, 1.0)
        odometry = Odometry(
            header=header, velocity_m_s=(0.0, 0.0, 0.0), velocity_covariance=covariance,
            yaw_rad=0.0, roll_rad=0.0, pitch_rad=0.0, reset=0,
        )  # fmt: skip
        assert intake.motion(odometry, header.stamp_ns).velocity_std_m_s == pytest.approx(std_m_s)

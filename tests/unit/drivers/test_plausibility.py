"""Motion telemetry that cannot be true is detected in time, and only then."""

import math
import random
from typing import Any

import numpy as np
import pytest

from drivers.ardrone.driver import LIMITS as ARDRONE
from drivers.mavlink.convert import LIMITS as MAVLINK
from drivers.plausibility.clock_watch import ClockWatch
from drivers.plausibility.health import Health, Sensor
from drivers.plausibility.motion import MotionMonitor, MotionSample
from drivers.tello.driver import LIMITS as TELLO
from groundstation.bus.messages import FlightState

MS = 1_000_000
S = 1_000_000_000
FAULT_S = 4.0
FLYING = FlightState.FLYING


def healthy(seconds, period_ms=5, seed=0, tilt_deg=2.0):
    """Yield samples of a flight: noise on everything, a slow swing."""
    rng = random.Random(seed)
    for number in range(round(seconds * 1000 / period_ms)):
        at_s = number * period_ms / 1000
        swing = math.radians(tilt_deg) * math.sin(at_s)
        yield MotionSample(
            S + number * period_ms * MS + rng.randrange(3 * MS),
            (0.3 * math.sin(at_s) + rng.gauss(0, 0.03), rng.gauss(0, 0.03)),
            rng.gauss(0, 0.003),
            swing + rng.gauss(0, 0.003),
            (rng.gauss(0, 0.03),) * 3 + (rng.gauss(0, 0.05),) * 3,
            number * period_ms * MS,
        )


def at_s(sample):
    return (sample.stamp_ns - S) / S


def judge(samples, limits=ARDRONE, state=FLYING):
    """Return when each sensor was first SUSPECT and BAD, and all texts."""
    first: dict[Any, Any] = {}
    monitor, said = MotionMonitor(limits), set()
    for sample in samples:
        for one in monitor.update(sample, state).findings:
            said.add(one.reason)
            for health in range(Health.SUSPECT, one.health + 1):
                first.setdefault((one.sensor, Health(health)), at_s(sample))
    return first, said


def broken(fault, **options):
    """Yield a flight whose samples pass `fault(sample, the one at which it began)` from 4 s on."""
    began = None
    for sample in healthy(8.0, **options):
        if at_s(sample) < FAULT_S:
            yield sample
            continue
        began = began or sample
        yield fault(sample, began)


def frozen(sample, began):
    return began._replace(stamp_ns=sample.stamp_ns)


def frozen_but_for_the_clock(sample, began):
    return began._replace(stamp_ns=sample.stamp_ns, vehicle_ns=sample.vehicle_ns)


def stuck_at_zero(sample, _):
    return sample._replace(velocity_m_s=(0.0, 0.0))


def both_axes_stuck(sample, _):
    return sample._replace(velocity_m_s=(-0.3, 0.4))


def one_axis_stuck(sample, began):
    return sample._replace(velocity_m_s=(0.5, sample.velocity_m_s[1]))


def attitude_stuck(sample, began):
    return sample._replace(roll_rad=began.roll_rad, pitch_rad=began.pitch_rad)


def imu_stuck(sample, began):
    return sample._replace(inertial=began.inertial)


def clock_stands(sample, began):
    return sample._replace(vehicle_ns=began.vehicle_ns)


def falls_behind(sample, began):
    return sample._replace(vehicle_ns=began.vehicle_ns + (sample.vehicle_ns - began.vehicle_ns) // 3)


def too_fast(sample, _):
    return sample._replace(velocity_m_s=(9.0, sample.velocity_m_s[1]))


def too_steep(sample, _):
    return sample._replace(roll_rad=math.radians(60) + sample.roll_rad)


def flickering(sample, _):
    return sample._replace(velocity_m_s=(2.0 * (sample.stamp_ns // (100 * MS) % 2), sample.velocity_m_s[1]))


@pytest.mark.parametrize("limits", [ARDRONE, MAVLINK], ids=["ardrone", "mavlink"])
@pytest.mark.parametrize("period_ms", [5, 20, 66])
@pytest.mark.parametrize(
    ("fault", "sensor", "bad_s", "word"),
    [
        (frozen, Sensor.TELEMETRY, 0.4, "all values repeat"),
        (frozen_but_for_the_clock, Sensor.TELEMETRY, 0.4, "all values repeat"),
        (stuck_at_zero, Sensor.VELOCITY, 0.8, "stuck at 0.00 m/s"),
        (both_axes_stuck, Sensor.VELOCITY, 0.8, "stuck at 0.50 m/s"),
        (one_axis_stuck, Sensor.VELOCITY, 0.8, "stuck at 0.50 m/s"),
        (attitude_stuck, Sensor.ATTITUDE, 0.6, "attitude is stuck"),
        (clock_stands, Sensor.CLOCK, 0.4, "clock stands"),
        (falls_behind, Sensor.CLOCK, 1.7, "late"),
        (too_fast, Sensor.VELOCITY, 0.3, "9.0 m/s, which it cannot do"),
        (too_steep, Sensor.ATTITUDE, 0.3, "60 deg, which it cannot do"),
        (flickering, Sensor.VELOCITY, 0.4, "jumps by 2.0 m/s"),
    ],
)
def test_each_fault_is_found_in_time_and_doubted_before(limits, period_ms, fault, sensor, bad_s, word):
    first, said = judge(broken(fault, period_ms=period_ms), limits)
    assert FAULT_S <= first[sensor, Health.SUSPECT] <= first[sensor, Health.BAD] <= FAULT_S + bad_s + period_ms / 1000
    assert any(word in reason for reason in said), said


@pytest.mark.parametrize(("limits", "late_s", "worst"), [(ARDRONE, 0.6, Health.BAD), (ARDRONE, 0.4, Health.SUSPECT),
                                                         (MAVLINK, 0.6, Health.SUSPECT)])  # fmt: skip
def test_a_velocity_that_our_own_loop_follows_must_be_younger(limits, late_s, worst):
    """An AR.Drone's loop is closed over the link; an autopilot closes its own, and stamps its messages."""
    monitor, found = MotionMonitor(limits), []
    for k in range(100):
        at_ns = S + k * 20 * MS
        old_ns = round(late_s * 1e9) if k > 50 else 0
        sample = MotionSample(at_ns, (0.2 + 0.001 * k, 0.1), 0.001 * k, 0.0, vehicle_ns=at_ns - old_ns)
        found.append(monitor.update(sample, FLYING).of(Sensor.CLOCK))
    assert max(found) is worst and max(found[:50]) is Health.GOOD


def test_a_stuck_imu_is_no_reason_to_stop():
    monitor = MotionMonitor(ARDRONE)
    for sample in broken(imu_stuck):
        report = monitor.update(sample, FLYING)
    assert report.of(Sensor.IMU) is Health.BAD and report.reason(Health.BAD, ARDRONE.essential) == ""


def test_a_level_vehicle_may_be_slow_for_longer():
    """Without a tilt that would move it, a standstill is more likely true."""
    level = [sample._replace(pitch_rad=sample.pitch_rad * 0.02) for sample in broken(stuck_at_zero, tilt_deg=0.0)]
    first, _ = judge(level)
    assert first[Sensor.VELOCITY, Health.BAD] == pytest.approx(FAULT_S + ARDRONE.stuck_alone_s, abs=0.05)


def test_one_jump_is_doubted_and_forgotten():
    def jump(sample, began):
        return sample._replace(velocity_m_s=(sample.velocity_m_s[0] + 0.9, sample.velocity_m_s[1]))

    monitor, worst = MotionMonitor(ARDRONE), Health.GOOD
    for sample in broken(jump):
        worst = max(worst, monitor.update(sample, FLYING).of(Sensor.VELOCITY))
    assert worst is Health.SUSPECT and monitor.report.of(Sensor.VELOCITY) is Health.GOOD


@pytest.mark.parametrize("period_ms", [5, 10])
def test_an_ardrone_cannot_change_its_velocity_by_a_third_of_a_metre_per_second_at_once(period_ms):
    """One jumped by 0.33 m/s as its ceiling camera went black, and pulled the belief of the whole team along."""

    def jump(sample, _):
        return sample._replace(velocity_m_s=(sample.velocity_m_s[0] + 0.33, sample.velocity_m_s[1]))

    first, said = judge(broken(jump, period_ms=period_ms), ARDRONE)
    assert FAULT_S <= first[Sensor.VELOCITY, Health.SUSPECT] <= FAULT_S + 2 * period_ms / 1000
    assert (Sensor.VELOCITY, Health.BAD) not in first and any("its velocity jumps by 0." in reason for reason in said)


def test_recovered_telemetry_is_good_after_a_second():
    monitor = MotionMonitor(ARDRONE)
    good_s = []
    for sample in healthy(12.0):
        stuck = FAULT_S <= at_s(sample) < 8.0
        report = monitor.update(stuck_at_zero(sample, None) if stuck else sample, FLYING)
        good_s += [at_s(sample)] if at_s(sample) > 8.0 and report.of(Sensor.VELOCITY) is Health.GOOD else []
    assert good_s[0] == pytest.approx(8.0 + ARDRONE.hold_s, abs=0.1)


@pytest.mark.parametrize("fault", [stuck_at_zero, attitude_stuck, imu_stuck])
def test_a_drone_on_the_floor_may_stand_still(fault):
    first, _ = judge((fault(sample, next(healthy(1.0))) for sample in healthy(5.0)), state=FlightState.LANDED)
    assert first == {}
    first, _ = judge((stuck_at_zero(sample, None) for sample in healthy(5.0)), state=FlightState.TAKING_OFF)
    assert first == {}


@pytest.mark.parametrize("limits", [ARDRONE, MAVLINK], ids=["ardrone", "mavlink"])
@pytest.mark.parametrize(
    ("fault", "sensor"),
    [
        (frozen, Sensor.TELEMETRY),
        (frozen, Sensor.CLOCK),
        (frozen_but_for_the_clock, Sensor.TELEMETRY),
        (clock_stands, Sensor.CLOCK),
    ],
)
def test_one_that_says_for_ever_that_it_stands_is_not_believed(limits, fault, sensor):
    first, _ = judge(broken(fault), limits, FlightState.LANDED)
    assert FAULT_S <= first[sensor, Health.BAD] <= FAULT_S + 0.4


def test_on_the_floor_repeats_count_only_where_noise_would_show():
    coarse = [frozen(sample, next(healthy(1.0)))._replace(vehicle_ns=None) for sample in healthy(5.0)]
    assert judge(coarse, TELLO, FlightState.LANDED) == ({}, set())
    still = [sample._replace(inertial=()) for sample in coarse]
    assert judge(still, ARDRONE, FlightState.LANDED) == ({}, set())


def test_telemetry_frozen_on_the_floor_is_good_soon_after_recovery():
    monitor, good_s = MotionMonitor(ARDRONE), list[float]()
    began = next(healthy(1.0))
    for sample in healthy(8.0):
        told = frozen(sample, began) if FAULT_S <= at_s(sample) < 6.0 else sample
        report = monitor.update(told, FlightState.LANDED)
        good_s += [at_s(sample)] if at_s(sample) > 6.0 and report.of(Sensor.TELEMETRY) is Health.GOOD else []
    assert good_s[0] == pytest.approx(6.0 + ARDRONE.hold_s, abs=0.1)


@pytest.mark.parametrize("period_ms", [5, 20, 66])
@pytest.mark.parametrize("limits", [ARDRONE, MAVLINK], ids=["ardrone", "mavlink"])
def test_healthy_flights_and_gaps_in_them_are_let_be(limits, period_ms):
    for seed in range(3):
        samples = [sample for sample in healthy(20.0, period_ms, seed) if not 5.0 < at_s(sample) < 5.4]
        assert judge(samples, limits) == ({}, set())


def test_a_restarted_clock_and_one_that_wraps_are_no_faults():
    watch = ClockWatch(wrap_s=2048.0)
    for number in range(4000):
        stands_s, late_s = watch.update(number * 5 * MS, (2_043_000 * MS + number * 5 * MS) % (2048 * S))
        assert stands_s == 0.0 and late_s == 0.0
    assert watch.update(20_000 * MS, 1_000 * MS) == (0.0, 0.0)


def test_a_clock_that_goes_back_a_little_is_late():
    watch = ClockWatch()
    for number in range(2000):
        watch.update(number * 5 * MS, 70_000 * MS + number * 5 * MS)
    assert watch.update(10_000 * MS, (80_000 - 1_800) * MS)[1] == pytest.approx(1.8, abs=1e-3)
    assert watch.update(10_500 * MS, (80_500 - 1_800) * MS)[1] == pytest.approx(1.8, abs=1e-3)


def test_the_recorded_flight_gives_no_alarm(real_data):
    """A real AR.Drone 2 in moving air: it stands for 4.6 s, takes off, and flies."""
    flight = np.load(real_data("ardrone_flight") / "flight.npz")
    times, altitude = flight["nav_time_s"], flight["nav_altitude_mm"]
    doubts: list[Any] = []
    monitor = MotionMonitor(ARDRONE)
    for at, velocity, rotation, force, height in zip(
        times, flight["nav_velocity_mm_s"], flight["nav_rotation_deg"], flight["nav_acceleration_g"], altitude,
        strict=True,
    ):  # fmt: skip
        sample = MotionSample(
            round(at * 1e9),
            (velocity[0] / 1000, velocity[1] / 1000),
            math.radians(rotation[0]),
            math.radians(rotation[1]),
            tuple(force.tolist()),
            round(at * 1e9),
        )
        # Judged from half a second before the ultrasound measures flight.
        doubts += monitor.update(sample, FLYING if height > 0 or at > 4.1 else FlightState.LANDED).findings
    assert not doubts and times[-1] > 45.0


def test_the_recorded_flight_with_a_fault_gives_one(real_data):
    flight = np.load(real_data("ardrone_flight") / "flight.npz")
    monitor, found_s = MotionMonitor(ARDRONE), None
    for at, rotation, force in zip(
        flight["nav_time_s"], flight["nav_rotation_deg"], flight["nav_acceleration_g"], strict=True
    ):
        if at < 10.0 or found_s is not None:
            continue
        roll, pitch = (math.radians(angle) for angle in rotation[:2])
        sample = MotionSample(round(at * 1e9), (0.0, 0.0), roll, pitch, tuple(force.tolist()))
        if monitor.update(sample, FLYING).of(Sensor.VELOCITY) is Health.BAD:
            found_s = at - 10.0
    assert found_s is not None and found_s <= 0.6

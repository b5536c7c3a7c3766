"""The drone's own state estimate errs by the measured figures: rms, delays, correlation, the jump of yaw."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from sim_bridge.devices.ardrone_control import FlightControl
from sim_bridge.scenario import DroneScenario
from sim_bridge.world.airframe import Airframe
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.noise import DelayLine, GaussMarkov, generator_of, standard_normals

TICK_S = 0.005


@dataclass
class Puppet:
    """A drone held in the air at chosen poses."""

    airframe: Airframe = field(default_factory=lambda: Airframe(0.0, 0.0, 0.7))
    battery: float = 0.9

    def lift(self, height_m: float = 1.5) -> "Puppet":
        self.airframe.z, self.airframe.on_ground = height_m, False
        return self


def sensors(puppet: Puppet, seed: int = 1, scenario: DroneScenario | None = None) -> Onboard:
    return Onboard(scenario or DroneScenario(), TICK_S, puppet.airframe, generator_of(seed, "onboard"))


def record(onboard: Onboard, puppet: Puppet, seconds: float, *names: str) -> np.ndarray:
    rows = []
    for _ in range(round(seconds / TICK_S)):
        onboard.step(puppet, motors_on=True)
        rows.append([getattr(onboard, name) for name in names])
    return np.array(rows)


def correlation_s(samples: np.ndarray) -> float:
    """Return the lag at which the autocorrelation falls to 1/e."""
    centred = samples - samples.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * len(centred))) ** 2
    covariance = np.fft.irfft(spectrum)[: len(centred)]
    return float(np.argmax(covariance < covariance[0] / math.e)) * TICK_S


@pytest.fixture(scope="module")
def long_hover() -> np.ndarray:
    """Five minutes of each of twelve drones at rest at 1.5 m: height error, roll, pitch, vx, vy."""
    runs = []
    for seed in range(12):
        puppet = Puppet().lift()
        onboard = sensors(puppet, seed)
        onboard.trim()
        record(onboard, puppet, 1.0, "vx")
        runs.append(record(onboard, puppet, 60.0, "height", "roll", "pitch", "vx", "vy"))
    return np.array(runs)


def rms(samples: np.ndarray) -> float:
    return float(np.sqrt(np.mean(samples**2)))


def test_height_is_34_mm_rms(long_hover: np.ndarray) -> None:
    assert rms(long_hover[:, :, 0] - 1.5) == pytest.approx(0.034, rel=0.12)


def test_attitude_is_1_degree_rms_with_5_s_correlation(long_hover: np.ndarray) -> None:
    attitude = np.degrees(long_hover[:, :, 1:3])
    assert rms(attitude) == pytest.approx(1.0, rel=0.2)
    # the mean of each run is removed, which shortens the correlation visible in 60 s
    times = [correlation_s(attitude[run, :, axis]) for run in range(12) for axis in range(2)]
    assert 2.5 < float(np.mean(times)) < 6.5


def test_velocity_noise_is_not_white(long_hover: np.ndarray) -> None:
    velocity = long_hover[:, :, 3:]
    assert rms(velocity) == pytest.approx(0.03, rel=0.1)
    per_frame = velocity[:, : 11 * 1090].reshape(12, -1, 13, 2).mean(axis=2) if velocity.shape[1] % 13 == 0 else None
    blocks = velocity[:, : velocity.shape[1] // 20 * 20].reshape(12, -1, 20, 2).mean(axis=2)
    assert per_frame is None or rms(per_frame) > 0.015
    assert rms(blocks) > 0.015, "averaging over 0.1 s must not make it good"


@pytest.mark.parametrize("seed", range(5))
def test_velocity_gain_and_delay(seed: int) -> None:
    puppet = Puppet().lift()
    onboard = sensors(puppet, seed, DroneScenario(velocity_noise_m_s=0.0))
    assert 0.80 <= onboard.velocity_gain <= 0.90
    assert 0.020 <= onboard.velocity_delay_s <= 0.040
    record(onboard, puppet, 0.5, "vx")
    puppet.airframe.vx, puppet.airframe.vy = math.cos(0.7), math.sin(0.7)
    speeds = record(onboard, puppet, 0.2, "vx")[:, 0]
    late = int(np.argmax(speeds > 0.1)) * TICK_S
    assert onboard.velocity_delay_s - 1e-9 <= late < onboard.velocity_delay_s + TICK_S
    assert speeds[-1] == pytest.approx(onboard.velocity_gain)


def test_height_is_85_ms_late() -> None:
    puppet = Puppet().lift(1.0)
    onboard = sensors(puppet, 1, DroneScenario(height_noise_m=0.0))
    record(onboard, puppet, 0.5, "height")
    puppet.airframe.z = 3.0
    heights = record(onboard, puppet, 0.3, "height")[:, 0]
    late = int(np.argmax(heights > 2.0)) * TICK_S
    assert 0.085 <= late <= 0.100, "85 ms, and a new value every 15 ms"


def test_yaw_wanders_3_degrees_about_the_jump() -> None:
    errors = []
    for seed in range(40):
        puppet = Puppet().lift()
        onboard = sensors(puppet, seed)
        record(onboard, puppet, 0.2, "yaw")
        first = onboard.yaw
        yaw = record(onboard, puppet, 30.0, "yaw")[:, 0]
        errors.append(math.remainder(yaw[-1] - first, math.tau))
    # difference of two values 30 s apart of a process with 3 deg rms and 30 s correlation, plus a drift of 0.55 deg
    expected = 3.0 * math.sqrt(2 * (1 - math.exp(-1)))
    assert math.degrees(rms(np.array(errors))) == pytest.approx(expected, rel=0.35)


@pytest.mark.parametrize("seed", range(6))
def test_yaw_is_relative_on_the_ground_and_jumps_once_at_lift_off(seed: int) -> None:
    puppet = Puppet()
    onboard = sensors(puppet, seed)
    onboard.step(puppet, False)
    assert abs(onboard.yaw) < math.radians(1)
    record(onboard, puppet, 1.0, "yaw")
    before = onboard.yaw
    puppet.lift(0.3)
    yaw = np.unwrap(record(onboard, puppet, 0.2, "yaw")[:, 0])
    assert np.count_nonzero(np.abs(np.diff(yaw)) > 0.1) == 1, "in one sample"
    assert math.radians(58) < abs(yaw[-1] - before) < math.radians(145)
    puppet.airframe.z, puppet.airframe.on_ground = 0.06, True
    record(onboard, puppet, 0.5, "yaw")
    before = onboard.yaw
    puppet.lift()
    record(onboard, puppet, 0.3, "yaw")
    assert abs(math.remainder(onboard.yaw - before, math.tau)) < math.radians(1.5)


def test_height_is_zero_on_the_ground() -> None:
    puppet = Puppet()
    onboard = sensors(puppet)
    assert (record(onboard, puppet, 1.0, "height") == 0.0).all()


def test_inertial_sensors_tell_down_from_up() -> None:
    puppet = Puppet().lift()
    onboard = sensors(puppet)
    forces = record(onboard, puppet, 1.0, "accelerometers")[:, 0]
    assert forces.mean(axis=0) == pytest.approx([0, 0, 0.92 * 9.81], abs=0.05)
    puppet.airframe.yaw_rate = 0.5
    assert record(onboard, puppet, 1.0, "gyros")[:, 0].mean(axis=0) == pytest.approx([0, 0, 0.5], abs=0.02)


def test_gauss_markov_is_stationary_and_correlated() -> None:
    ends = []
    for seed in range(400):
        process = GaussMarkov(2.0, 1.0, 0.1, standard_normals(np.random.default_rng(seed)))
        first = process.value
        for _ in range(10):
            process.step()
        ends.append((first, process.value))
    first, last = np.array(ends).T
    assert first.std() == pytest.approx(2.0, rel=0.15)
    assert last.std() == pytest.approx(2.0, rel=0.15)
    assert np.corrcoef(first, last)[0, 1] == pytest.approx(math.exp(-1), abs=0.12)


def test_delay_line_rounds_up() -> None:
    line: DelayLine[int] = DelayLine(0.012, 0.005, -1)
    assert [line.push(n) for n in range(5)] == [-1, -1, -1, 0, 1]
    assert DelayLine(0.0, 0.005, 0).push(5) == 5


def test_gyros_in_flight_shake_as_recorded_and_their_heading_does_not_wander_away() -> None:
    """Of a real AR.Drone: 0.046 rad/s, means of 40 ms 0.019, of 200 ms 0.0055; its heading 0.19 deg after 10 s."""
    runs = []
    for seed in range(8):
        puppet = Puppet().lift()
        runs.append(np.array([rates[2] for rates in gyros(sensors(puppet, seed), puppet, 40.0)]))
    rates = np.array(runs)[:, 400:]
    assert rates.std() == pytest.approx(0.044, rel=0.05)
    for samples, wanted in ((8, 0.019), (40, 0.0050)):
        assert rates[:, : len(rates[0]) // samples * samples].reshape(-1, samples).mean(axis=1).std() == pytest.approx(
            wanted, rel=0.25
        )
    every = {"all samples": TICK_S * np.cumsum(rates, axis=1), "every second": 2 * TICK_S * np.cumsum(rates[:, ::2], 1)}
    for name, headings in every.items():
        after = round(10.0 / (TICK_S if name == "all samples" else 2 * TICK_S))
        wandered = np.degrees(headings[:, after:] - headings[:, :-after]).std()
        assert 0.1 < wandered < 0.3, name


def gyros(onboard: Onboard, puppet: Puppet, seconds: float) -> list[tuple[float, float, float]]:
    rows = []
    for _ in range(round(seconds / TICK_S)):
        onboard.step(puppet, motors_on=True)
        rows.append(onboard.gyros)
    return rows


def test_a_flat_trim_takes_the_tilt_of_that_moment_for_level() -> None:
    drone = Quadrotor((0.0, 0.0), 0.0, DroneScenario(), TICK_S, generator_of(1, "drone_1"))
    onboard = Onboard(DroneScenario(attitude_noise_deg=0.0), TICK_S, drone.airframe, generator_of(1, "onboard"))
    drone.airframe.roll, drone.airframe.pitch = 0.2, -0.1
    FlightControl(drone, onboard).obey_datagram(b"AT*FTRIM=1\r", 0)
    drone.airframe.roll = drone.airframe.pitch = 0.0
    onboard.step(drone, motors_on=False)
    assert (onboard.roll, onboard.pitch) == pytest.approx((-0.2, 0.1))

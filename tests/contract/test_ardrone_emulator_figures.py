"""The emulated drone's motion on the wire against measurements of real ones (docs/reference/ardrone.md 7).

The bench (conftest.py) assembles and reads bytes by hand (docs/reference/ardrone.md 2, 4).
"""

import math
import struct
from typing import Any

import numpy as np
import pytest

TAKE_OFF, LAND = 290718208, 290717696
MINUS_ONE = -1082130432
TICK_S = 0.005
PWM, PHYS, ALTITUDE = 9, 3, 10


def option(packet: bytes, tag: int) -> int:
    """Return the offset of an option."""
    offset = 16
    while True:
        found, size = struct.unpack_from("<HH", packet, offset)
        if found == tag:
            return offset
        offset += size


def record(bench: Any, seconds: float, *commands: str) -> list[bytes]:
    """Send commands every 30 ms and return one full packet for each 5 ms."""
    packets: list[bytes] = []
    for tick in range(round(seconds / TICK_S)):
        if tick % 6 == 0:
            bench.say(*commands)
        packets += bench.tick()
    return packets


def column(packets: list[bytes], form: str, offset: int, tag: int | None = None) -> np.ndarray:
    at = 0 if tag is None else option(packets[0], tag)
    return np.array([struct.unpack_from("<" + form, packet, at + offset)[0] for packet in packets], dtype=float)


def imu(packets: list[bytes]) -> tuple[np.ndarray, np.ndarray]:
    """Return accelerations [m/s^2] and rates [rad/s] (n, 3), high-pass filtered at 0.2 s."""
    at = option(packets[0], PHYS)
    rows = np.array([struct.unpack_from("<6f", packet, at + 10) for packet in packets])
    window = np.ones(40) / 40
    slow = np.stack([np.convolve(rows[:, axis], window, mode="same") for axis in range(6)], axis=1)
    fast = (rows - slow)[40:-40]
    return fast[:, :3] * 9.81e-3, np.radians(fast[:, 3:])


@pytest.fixture
def take_off(bench: Any) -> list[bytes]:
    bench.connect()
    record(bench, 0.3, f"REF,{LAND}")
    return record(bench, 7.0, f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")


def test_take_off_is_the_recorded_one(take_off: list[bytes]) -> None:
    altitude, psi, pwm = column(take_off, "i", 40), column(take_off, "f", 36), column(take_off, "B", 4, PWM)
    seconds = np.arange(len(altitude)) * TICK_S
    seen = int(np.argmax(altitude > 0))
    assert seconds[seen] == pytest.approx(3.44, abs=0.08), "altitude is reported 0 until then"
    assert altitude[seen] == pytest.approx(274, abs=70)
    assert altitude[seconds >= 3.85][0] == pytest.approx(616, abs=100)
    assert altitude.max() == pytest.approx(821, abs=80)
    assert altitude[seconds > 6.0].mean() == pytest.approx(760, abs=80)
    jump = int(np.argmax(np.abs(np.diff(psi)) > 20_000)) + 1
    assert seconds[jump] == pytest.approx(3.41, abs=0.08), "the heading jumps in one sample"
    assert 0.0 <= seconds[seen] - seconds[jump] <= 0.08, "just before the altitude shows"
    for second, value, margin in ((0.05, 70, 1), (0.85, 72, 1), (1.7, 80, 2), (3.2, 185, 16)):
        assert pwm[seconds >= second][0] == pytest.approx(value, abs=margin), f"PWM after {second} s"
    assert 125 <= pwm[(seconds > 3.3) & (seconds < 5.0)].min() <= 155, "a dip while it rises too far"
    assert pwm[seconds > 6.0].mean() == pytest.approx(170, abs=5), "67 % of 255 carry it"


def test_landing_takes_two_to_four_seconds(bench: Any) -> None:
    bench.fly()
    packets = record(bench, 6.0, f"REF,{LAND}")
    flying = column(packets, "I", 4).astype(int) & 1
    assert 2.0 <= np.argmin(flying) * TICK_S <= 4.0


def test_the_tilt_answers_as_recorded(bench: Any) -> None:
    bench.fly()
    before = column(record(bench, 0.5, "PCMD,1,0,0,0,0"), "f", 28).mean()
    packets = record(bench, 1.0, f"PCMD,1,0,{MINUS_ONE},0,0")
    tilt = (before - column(packets, "f", 28)) / 1000
    peak = tilt.max()
    for share, recorded_ms in ((0.10, 90), (0.63, 180), (0.90, 270)):
        measured_ms = 1000 * TICK_S * (1 + int(np.argmax(tilt >= share * peak)))
        assert abs(measured_ms - recorded_ms) <= 20, share
    assert 11.8 <= peak <= 13.3, "12 degrees and 8 % more"
    speed = column(packets, "f", 44) / 1000 / bench.world.onboard["d"].velocity_gain
    assert 1.8 <= (speed[120] - speed[80]) / 0.2 <= 2.3, "acceleration while tilted"


@pytest.mark.parametrize(("seconds", "recorded"), [(0.5, 1.1), (1.0, 1.95), (2.0, 2.7)])
def test_a_pulse_of_tilt_brings_the_recorded_speed(bench: Any, seconds: float, recorded: float) -> None:
    bench.fly()
    bench.keep(seconds, f"PCMD,1,0,{MINUS_ONE},0,0")
    speeds = []
    for _ in range(10):
        bench.keep(0.03, "PCMD,1,0,0,0,0")
        speeds.append(math.hypot(bench.body.vx, bench.body.vy))
    assert max(speeds) == pytest.approx(recorded, rel=0.12)


def test_velocity_is_under_reported(bench: Any) -> None:
    bench.fly()
    true, reported = [], []
    for _ in range(50):
        bench.keep(0.03, f"PCMD,1,0,{MINUS_ONE},0,0")
        true.append(math.hypot(bench.body.vx, bench.body.vy))
        reported.append(math.hypot(bench.demo()[6], bench.demo()[7]) / 1000)
    gain = np.polyfit(true[15:], reported[15:], 1)[0]
    assert 0.75 <= gain <= 0.92, "recorded: 0.79 in wind, 0.79 to 0.90 over flights"


def test_altitude_lags_and_comes_in_steps(bench: Any) -> None:
    bench.fly()
    bench.keep(1.0, "PCMD,0,0,0,0,0")
    rows = []
    for tick in range(800):
        if tick % 6 == 0:
            up = 1061997773 if tick < 300 else -1085485875  # 0.8, -0.8
            bench.say(f"PCMD,1,0,0,{up},0")
        bench.tick()
        rows.append((bench.body.z, bench.demo()[5] / 1000))
    z, altitude = np.array(rows).T
    errors = {lag: np.std(z[40 : 800 - lag] - altitude[40 + lag :]) for lag in range(40)}
    assert 1000 * TICK_S * min(errors, key=errors.__getitem__) == pytest.approx(90, abs=25)
    changes = np.count_nonzero(np.diff(altitude)) / (len(altitude) * TICK_S)
    assert 1000 / changes == pytest.approx(15.6, abs=1.5), "ms between new values"


def test_inertial_noise_at_rest_idling_and_in_flight(bench: Any) -> None:
    bench.connect()
    accelerations, rates = imu(record(bench, 4.0, f"REF,{LAND}"))
    assert accelerations.std(axis=0) == pytest.approx([0.031, 0.001, 0.017], rel=0.15)
    assert (rates.std(axis=0) < 9e-4).all()
    accelerations, rates = imu(record(bench, 2.5, f"REF,{TAKE_OFF}"))
    assert accelerations.std(axis=0) == pytest.approx([0.13, 0.10, 0.07], rel=0.15)
    assert rates.std(axis=0) == pytest.approx([0.016, 0.016, 0.048], rel=0.15)
    record(bench, 4.0, f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")
    accelerations, rates = imu(record(bench, 4.0, f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0"))
    assert accelerations.std(axis=0) == pytest.approx([0.045, 0.045, 0.045], rel=0.15)
    assert rates.std(axis=0) == pytest.approx([0.031, 0.032, 0.044], rel=0.15)


@pytest.mark.parametrize(("percent", "millivolts"), [(50, 11686), (65, 11876)])
def test_battery_voltage(bench: Any, percent: int, millivolts: int) -> None:
    bench.world.drones["d"].battery = percent / 100
    bench.connect()
    bench.keep(0.1)
    raw = option(bench.packets[-1], 2)
    assert bench.demo()[1] == percent
    assert struct.unpack_from("<I", bench.packets[-1], raw + 20)[0] == pytest.approx(millivolts, abs=60)

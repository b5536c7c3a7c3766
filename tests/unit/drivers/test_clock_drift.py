"""A vehicle's clock relative to ours: its rate, and the delay of its telemetry."""

import numpy as np
import pytest

from drivers.ardrone.driver import LIMITS as ARDRONE
from drivers.plausibility.clock_drift import ClockDrift
from drivers.plausibility.health import Health, Sensor
from drivers.plausibility.limits import PlausibilityLimits
from drivers.plausibility.motion import MotionMonitor, MotionSample
from groundstation.bus.messages import FlightState

MS = 1_000_000
BOOTED = 1_700_000_000_000 * MS


def heard(seconds: float, ppm: float = 0.0, jitter_ms: float = 0.0, late_ms: float = 0.0) -> ClockDrift:
    """Receive 100 packets a second, one of them late, with a clock that is fast by ppm."""
    clock, rng = ClockDrift(), np.random.default_rng(3)
    for number in range(round(100 * seconds)):
        made_ns = BOOTED + 10 * MS * number
        lag_ms = 2.0 + rng.exponential(jitter_ms) + (late_ms if number == 150 else 0.0)
        vehicle_ns = round(10 * MS * number * (1.0 + 1e-6 * ppm))
        clock.update(made_ns + round(lag_ms * MS), vehicle_ns)
    return clock


@pytest.mark.parametrize("ppm", [-3000.0, -40.0, 0.0, 250.0, 20_000.0])
def test_a_clock_that_goes_fast_or_slow_is_measured(ppm: float) -> None:
    figures = heard(10.0, ppm).figures
    assert figures is not None and figures.drift_ppm == pytest.approx(ppm, abs=1e-3 * abs(ppm) + 0.1)


def test_a_radio_that_scatters_hides_no_drift() -> None:
    for ppm in (0.0, 1500.0):
        figures = heard(8.0, ppm, jitter_ms=5.0).figures
        assert figures is not None and figures.drift_ppm == pytest.approx(ppm, abs=120.0)


def test_a_drift_is_not_told_before_it_is_known() -> None:
    short = heard(2.0).figures
    assert short is not None and short.drift_ppm is None
    assert heard(0.3).figures is None
    wild = heard(5.0, jitter_ms=200.0).figures
    assert wild is not None and wild.drift_ppm is None


def test_the_latest_packet_is_told_by_how_late_it_was() -> None:
    figures = heard(10.0, late_ms=180.0).figures
    assert figures is not None and figures.late_ms == pytest.approx(180.0, abs=0.1)
    assert figures.drift_ppm == pytest.approx(0.0, abs=1.0)


def test_a_clock_that_starts_over_is_compared_anew() -> None:
    clock = heard(10.0, 5000.0)
    last_ns = BOOTED + 10_000 * MS
    clock.update(last_ns, 0)
    assert clock.figures is None
    for number in range(1000):
        clock.update(last_ns + 10 * MS * number, 10 * MS * number)
    assert clock.figures is not None and clock.figures.drift_ppm == pytest.approx(0.0, abs=0.1)


def test_a_vehicle_on_the_floor_is_listened_to_as_well() -> None:
    monitor = MotionMonitor(PlausibilityLimits())
    for number in range(600):
        at_ns = 10 * MS * number
        sample = MotionSample(BOOTED + at_ns, (0.0, 0.0), 0.0, 0.0, vehicle_ns=at_ns)
        monitor.update(sample, FlightState.LANDED)
    assert monitor.clock.figures is not None and monitor.clock.figures.drift_ppm == pytest.approx(0.0, abs=0.1)
    silent = MotionMonitor(PlausibilityLimits())
    silent.update(MotionSample(BOOTED, (0.0, 0.0), 0.0, 0.0), FlightState.LANDED)
    assert silent.clock.figures is None


def flown(delay_s, ppm=0.0, seconds=900.0, floor_s=20.0, period_ms=50):
    """Return when the clock was first BAD [s since lift-off], None: never; delay_s: of a packet made then."""
    monitor, rng = MotionMonitor(ARDRONE), np.random.default_rng(5)
    for number in range(round((floor_s + seconds) * 1000 / period_ms)):
        at_s = number * period_ms / 1000 - floor_s
        heard_s = at_s + delay_s(at_s) + rng.uniform(0.0, 0.004)
        a, b, c = rng.normal(0.0, 0.003, 3).tolist()
        vehicle_ns = round(number * period_ms * MS * (1.0 + 1e-6 * ppm))
        sample = MotionSample(BOOTED + round(heard_s * 1e9), (a, b), b, c, (a, b, c), vehicle_ns)
        state = FlightState.LANDED if at_s < 0.0 else FlightState.FLYING
        if monitor.update(sample, state).of(Sensor.CLOCK) is Health.BAD:
            return at_s
    return None


@pytest.mark.parametrize("ppm", [-20_000.0, -10_000.0, 10_000.0, 20_000.0])
@pytest.mark.parametrize("floor_s", [0.0, 20.0])
def test_a_healthy_vehicle_with_a_slow_or_fast_clock_is_never_late(ppm, floor_s):
    assert flown(lambda _: 0.0, ppm, floor_s=floor_s) is None


@pytest.mark.parametrize("ppm", [-20_000.0, -10_000.0, 0.0, 10_000.0])
def test_what_is_truly_late_is_bad_though_the_clock_is_slow(ppm):
    assert flown(lambda at_s: 0.7 if at_s > 100.0 else 0.0, ppm, 110.0) == pytest.approx(100.0, abs=0.1)


@pytest.mark.parametrize(("grows", "bad_s"), [(0.01, 250.0), (0.02, 140.0), (0.1, 106.0)])
def test_a_queue_that_grows_in_flight_is_not_taken_for_a_slow_clock(grows, bad_s):
    """Late by half a second in truth after 50, 25 and 5 s."""
    found = flown(lambda at_s: grows * max(0.0, at_s - 100.0), seconds=300.0)
    assert found is not None and found < bad_s


def test_a_clock_that_stands_is_bad_at_once():
    monitor = MotionMonitor(ARDRONE)
    for number in range(2000):
        vehicle_ns = round(10 * MS * min(number, 1500) * 0.99)
        values = (0.001 * number, 0.0)
        sample = MotionSample(BOOTED + 10 * MS * number, values, 0.001 * number, 0.0, vehicle_ns=vehicle_ns)
        health = monitor.update(sample, FlightState.FLYING).of(Sensor.CLOCK)
        assert health is (Health.GOOD if number < 1530 else Health.BAD)

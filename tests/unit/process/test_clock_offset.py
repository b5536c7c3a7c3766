"""The offset of another clock from round trips: under jitter, loss and drift, and cases without a result."""

import random

import pytest

from groundstation.process.clock_offset import OffsetFilter, RoundTrip, led

MS, S = 1_000_000, 1_000_000_000
OFFSET_NS = 895 * S


def trip(at_ns: int, out_ns: int, back_ns: int, offset_ns: int = OFFSET_NS, held_ns: int = 3 * MS) -> RoundTrip:
    received_ns = at_ns + out_ns + offset_ns
    return RoundTrip(at_ns, received_ns, received_ns + held_ns, at_ns + out_ns + held_ns + back_ns)


def way_ns(dice: random.Random) -> int:
    """Return a message's transit time: 20 ms, a queue, and now and then the repetition of a lost packet."""
    return 20 * MS + round(dice.expovariate(1.0) * MS) + (200 * MS if dice.random() < 0.01 else 0)


@pytest.mark.parametrize("drift_ppm", [0.0, 40.0, -40.0])
def test_through_queues_and_drift_it_is_right_within_a_fraction_of_a_millisecond(drift_ppm: float) -> None:
    dice, clock = random.Random(3), OffsetFilter()
    for tick in range(20 * 60):
        at_ns = tick * 50 * MS
        offset_ns = OFFSET_NS + round(at_ns * drift_ppm * 1e-6)
        out_ns, back_ns = (way_ns(dice) for _ in "ab")
        clock.take(trip(at_ns, out_ns, back_ns, offset_ns))
    assert clock.known
    assert clock.offset_ns(at_ns) == pytest.approx(offset_ns, abs=0.15 * MS)
    assert clock.error_ns == pytest.approx(20 * MS, abs=0.2 * MS)


def test_it_is_not_known_before_ten_round_trips() -> None:
    clock = OffsetFilter()
    for tick in range(10):
        assert not clock.known
        clock.take(trip(tick * 50 * MS, MS, MS))
    assert clock.known and clock.offset_ns(S) == OFFSET_NS


def test_half_of_the_difference_of_both_ways_stays_and_is_within_the_error_that_is_told() -> None:
    clock = OffsetFilter()
    for tick in range(100):
        clock.take(trip(tick * 50 * MS, 30 * MS, 10 * MS))
    assert clock.offset_ns(5 * S) - OFFSET_NS == 10 * MS <= clock.error_ns == 20 * MS


def test_impossible_round_trips_are_left_out() -> None:
    clock = OffsetFilter()
    for tick in range(20):
        at_ns = tick * 50 * MS
        clock.take(RoundTrip(at_ns, OFFSET_NS, OFFSET_NS + 10 * MS, at_ns + MS))
        clock.take(RoundTrip(at_ns, OFFSET_NS, OFFSET_NS - 10 * MS, at_ns + MS))
    assert not clock.known


def test_a_clock_is_led_slowly_and_set_when_it_is_far_off() -> None:
    assert led(0, 5 * MS, 0.05) == 25_000
    assert led(0, -5 * MS, 0.05) == -25_000
    assert led(0, 1_000, 0.05) == 1_000
    assert led(0, 30 * MS, 0.05) == 30 * MS


@pytest.mark.parametrize("asleep_s", [0.5, -0.5, 30.0, -3600.0])
def test_after_one_host_slept_only_the_new_offset_counts(asleep_s: float) -> None:
    dice, clock = random.Random(5), OffsetFilter()
    worst_ns = 0
    for tick in range(20 * 40):
        at_ns = tick * 50 * MS
        offset_ns = OFFSET_NS + (round(asleep_s * S) if tick >= 400 else 0)
        clock.take(trip(at_ns, way_ns(dice), way_ns(dice), offset_ns))
        if tick >= 405:  # five trips, a quarter of a second
            worst_ns = max(worst_ns, abs(clock.offset_ns(at_ns) - offset_ns))
    assert worst_ns < 25 * MS


def test_a_trip_that_was_held_up_on_one_way_is_not_taken_for_a_clock_that_was_set() -> None:
    clock = OffsetFilter()
    for tick in range(200):
        clock.take(trip(tick * 50 * MS, 900 * MS if tick % 40 == 39 else 20 * MS, 20 * MS))
    assert clock.offset_ns(10 * S) == pytest.approx(OFFSET_NS, abs=MS)

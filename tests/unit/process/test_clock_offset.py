"""The offset of another clock from round trips: under jitter, loss and drift, and cases without a result."""

import random
from collections.abc import Callable, Iterator
from typing import NamedTuple

import pytest

from groundstation.process.clock_offset import OffsetFilter, RoundTrip, led

MS, S = 1_000_000, 1_000_000_000
OFFSET_NS = 895 * S


class Reading(NamedTuple):
    """A followed clock: the time, how far it is off, and the published error."""

    at_s: float
    off_ms: float
    told_ms: float


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
    used_ns = clock.offset_ns(at_ns)
    assert 20 * MS <= clock.error_ns(used_ns, at_ns) < 22 * MS, (
        "half a round trip, and what clocks may drift in a second"
    )


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
    offset_ns = clock.offset_ns(5 * S)
    assert offset_ns - OFFSET_NS == 10 * MS
    assert clock.error_ns(offset_ns, 5 * S) == pytest.approx(20 * MS, abs=0.6 * MS)
    assert clock.error_ns(offset_ns - 7 * MS, 5 * S) == pytest.approx(27 * MS, abs=0.6 * MS)


def test_impossible_round_trips_are_left_out() -> None:
    clock = OffsetFilter()
    for tick in range(20):
        at_ns = tick * 50 * MS
        clock.take(RoundTrip(at_ns, OFFSET_NS, OFFSET_NS + 10 * MS, at_ns + MS))
        clock.take(RoundTrip(at_ns, OFFSET_NS, OFFSET_NS - 10 * MS, at_ns + MS))
    assert not clock.known


def test_a_clock_is_led_slowly_and_set_when_it_is_far_off() -> None:
    assert led(0, 5 * MS, 0.05) == 50_000
    assert led(0, -5 * MS, 0.05) == -50_000
    assert led(0, 1_000, 0.05) == 1_000
    assert led(0, 30 * MS, 0.05) == 30 * MS


def test_a_clock_that_is_far_ahead_runs_at_half_speed_and_never_stands_still() -> None:
    assert led(0, -3 * S, 0.05) == -25 * MS
    assert led(0, -3 * S, 2.0) == -50 * MS, "once after a pause"
    assert led(0, -21 * MS, 0.05) == -21 * MS


def test_where_nobody_flies_small_corrections_are_made_at_once() -> None:
    assert led(0, 5 * MS, 0.05, rests=True) == 5 * MS
    assert led(0, -5 * MS, 0.05, rests=True) == -5 * MS
    assert led(0, -3 * S, 0.05, rests=True) == -25 * MS


def followed(ahead: Callable[[float], float], queue_ms: Callable[[float], float], base_ms: float) -> Iterator[Reading]:
    """Yield a followed clock 20 times a second for a minute; ahead: the other clock at a time [s]."""
    dice, clock, under_way, used_ns = random.Random(1), OffsetFilter(), list[RoundTrip](), 0
    for tick in range(20 * 60):
        at_ns = tick * 50 * MS
        out_ns, back_ns = (round((base_ms + dice.expovariate(0.5)) * MS) for _ in "ab")
        out_ns += round(queue_ms(at_ns / S) * MS)
        under_way.append(trip(at_ns, out_ns, back_ns, OFFSET_NS + round(ahead((at_ns + out_ns) / S) * S)))
        for one in [one for one in under_way if one.heard_ns <= at_ns]:
            clock.take(one)
            under_way.remove(one)
        if clock.known:
            wanted_ns = clock.offset_ns(at_ns)
            used_ns = led(used_ns, wanted_ns, 0.05) if used_ns else wanted_ns
            off_ns = abs(used_ns - OFFSET_NS - round(ahead(at_ns / S) * S))
            yield Reading(at_ns / S, off_ns / MS, clock.error_ns(used_ns, at_ns) / MS)


QUIET, FIRST_SECOND = (lambda _: 0.0), (lambda at_s: 30.0 if at_s < 1.0 else 0.0)


@pytest.mark.parametrize("base_ms", [0.25, 5.0])
@pytest.mark.parametrize(
    ("ahead", "queue_ms", "settled_s", "most_ms"),
    [
        pytest.param(lambda _: 0.0, QUIET, 0.0, 0.2, id="undisturbed"),
        pytest.param(lambda at_s: 200e-6 * at_s, QUIET, 0.0, 0.96, id="drift"),
        pytest.param(lambda at_s: 20e-6 * at_s, FIRST_SECOND, 18.0, 0.2, id="queue in the first second"),
        pytest.param(lambda at_s: 500e-6 * at_s, QUIET, 15.0, 0.2, id="slewed by the kernel"),
        pytest.param(lambda at_s: 500e-6 * max(0.0, at_s - 30.0), QUIET, 0.0, 3.0, id="slewed from some time on"),
    ],
)
def test_the_error_that_is_told_bounds_that_of_the_followed_clock(
    ahead: Callable[[float], float],
    queue_ms: Callable[[float], float],
    settled_s: float,
    most_ms: float,
    base_ms: float,
) -> None:
    readings = list(followed(ahead, queue_ms, base_ms))
    assert all(one.off_ms <= one.told_ms for one in readings)
    assert max(one.off_ms for one in readings if one.at_s >= settled_s) < most_ms
    assert readings[-1].told_ms < base_ms + 2.5


def test_a_clock_that_is_slewed_by_a_percent_is_told_with_a_larger_error() -> None:
    readings = list(followed(lambda at_s: 0.01 * at_s, QUIET, 0.25))
    assert all(one.off_ms <= one.told_ms for one in readings) and readings[-1].told_ms > 10.0


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


def test_trips_that_waited_for_a_sleeping_host_do_not_keep_the_former_offset_alive() -> None:
    clock, asleep_ns, woken_ns = OffsetFilter(), 3 * S, 13 * S
    for tick in range(200):
        clock.take(trip(tick * 50 * MS, 5 * MS, 5 * MS))
    for tick in range(200, 260):
        at_ns = tick * 50 * MS
        clock.take(trip(at_ns, woken_ns - at_ns + MS, 5 * MS, OFFSET_NS - asleep_ns))
    for tick in range(260, 263):
        clock.take(trip(tick * 50 * MS, 5 * MS, 5 * MS, OFFSET_NS - asleep_ns))
    assert clock.offset_ns(woken_ns) == pytest.approx(OFFSET_NS - asleep_ns, abs=6 * MS)


def test_a_trip_that_was_held_up_on_one_way_is_not_taken_for_a_clock_that_was_set() -> None:
    clock = OffsetFilter()
    for tick in range(200):
        clock.take(trip(tick * 50 * MS, 900 * MS if tick % 40 == 39 else 20 * MS, 20 * MS))
    assert clock.offset_ns(10 * S) == pytest.approx(OFFSET_NS, abs=MS)

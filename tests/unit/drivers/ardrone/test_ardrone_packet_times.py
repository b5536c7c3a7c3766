"""Packets dated by the drone's clock: over stalled links, clocks that run wrong, start over, or are set."""

import random
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest

from drivers.ardrone.packet_times import WRAP_S, PacketTimes
from groundstation.time_units import NS_PER_MS, NS_PER_S

PERIOD_NS, START_NS, OLDEST_NS = 5 * NS_PER_MS, 10**12, 500 * NS_PER_MS
WRAP_NS = round(WRAP_S * NS_PER_S)


def sent_ns(seconds: float) -> range:
    return range(0, round(seconds * NS_PER_S), PERIOD_NS)


def delayed(sent: int, draw: random.Random) -> int:
    """Return when a packet arrives, 1 to 6 ms after it was sent."""
    return START_NS + sent + NS_PER_MS + round(5 * NS_PER_MS * draw.random())


def stalled(arrivals: Iterator[int] | list[int], begin_s: float, lasts_s: float) -> list[int]:
    """Return times of arrival with those of a stall at its end."""
    begin, end = (START_NS + round(at * NS_PER_S) for at in (begin_s, begin_s + lasts_s))
    return [end if begin <= arrival < end else arrival for arrival in arrivals]


def date(arrivals: list[int], drone_ns: Callable[[int], int | None], seconds: float) -> list[int]:
    times = PacketTimes()
    return [times.date(arrival, drone_ns(sent)) for arrival, sent in zip(arrivals, sent_ns(seconds), strict=True)]


@pytest.mark.parametrize("lasts_s", [0.15, 0.4])
@pytest.mark.parametrize("rate", [0.98, 1.0, 1.02])
def test_what_a_stall_held_up_is_dated_as_if_it_had_not_waited(rate: float, lasts_s: float) -> None:
    draw = random.Random(1)
    free = [delayed(sent, draw) for sent in sent_ns(60.0)]
    arrivals = stalled(stalled(free, 20.0, lasts_s), 50.0, lasts_s)
    dated = date(arrivals, lambda sent: round(rate * sent) % WRAP_NS, 60.0)
    errors = [got - START_NS - sent for got, sent in zip(dated, sent_ns(60.0), strict=True)]
    slip_ns = (0.02 + abs(rate - 1.0)) * lasts_s * NS_PER_S
    assert max(errors[200:]) <= 8 * NS_PER_MS + slip_ns
    assert min(errors) >= -slip_ns


@pytest.mark.parametrize("begun_s", [0.0, 700.0, 2046.0])
@pytest.mark.parametrize("again_s", [None, 0.0, 3.0])
def test_a_clock_that_wraps_or_that_a_reboot_resets_dates_on(begun_s: float, again_s: float | None) -> None:
    """The drone's clock wraps after 2048 s; it is restarted after 5 s, or never."""

    def drone_ns(sent: int) -> int:
        if again_s is not None and sent >= 5 * NS_PER_S:
            return sent + round((again_s - 5.0) * NS_PER_S)
        return (sent + round(begun_s * NS_PER_S)) % WRAP_NS

    arrivals = stalled([START_NS + sent for sent in sent_ns(8.0)], 7.0, 0.15)
    dated = date(arrivals, drone_ns, 8.0)
    errors = [got - START_NS - sent for got, sent in zip(dated, sent_ns(8.0), strict=True)]
    settled = [error for error, sent in zip(errors, sent_ns(8.0), strict=True) if not 5.0 <= sent / NS_PER_S < 5.6]
    assert max(map(abs, settled)) <= 4 * NS_PER_MS


@pytest.mark.parametrize("step_s", [0.03, 0.25, 0.45, 0.9, 30.0])
def test_our_own_clock_put_forward_leaves_packets_dated_old_for_half_a_second_at_most(step_s: float) -> None:
    step_ns = round(step_s * NS_PER_S)
    arrivals = [START_NS + sent + (step_ns if sent >= 2 * NS_PER_S else 0) for sent in sent_ns(4.0)]
    dated = date(arrivals, lambda sent: sent, 4.0)
    ages = [arrival - got for arrival, got in zip(arrivals, dated, strict=True)]
    assert max(ages) <= OLDEST_NS
    later = [age for age, sent in zip(ages, sent_ns(4.0), strict=True) if sent > 2.505 * NS_PER_S]
    assert max(later) <= 20 * NS_PER_MS and later[-1] == 0


def test_no_packet_is_dated_later_than_it_came_nor_before_another_nor_much_too_old() -> None:
    """Whatever the drone's clock says: it errs, stands, goes back, starts over, or is absent."""
    draw, drone_ns = random.Random(2), 0
    arrival, times, dated = START_NS, PacketTimes(), list[tuple[int, int]]()
    for _ in range(20_000):
        arrival += round(draw.choice((0.0, 0.1, 1.0, 1.0, 3.0, 40.0)) * PERIOD_NS)
        step = draw.choice((0.0, 1.0, 1.0, 1.0, 2.0, -3.0, 90.0, -900.0)) if draw.random() < 0.1 else 1.0
        drone_ns = (drone_ns + round(step * PERIOD_NS)) % WRAP_NS
        dated.append((arrival, times.date(arrival, None if draw.random() < 0.01 else drone_ns)))
    assert all(came - OLDEST_NS <= got <= came for came, got in dated)
    assert all(before <= after for (_, before), (_, after) in pairwise(dated))


def test_without_a_clock_packets_are_dated_by_their_arrival() -> None:
    arrivals = stalled([START_NS + sent for sent in sent_ns(2.0)], 1.0, 0.15)
    assert date(arrivals, lambda _: None, 2.0) == arrivals

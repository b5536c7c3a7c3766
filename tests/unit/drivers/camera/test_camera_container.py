"""Packets that ffmpeg reads: their times."""

from fractions import Fraction

import av
import pytest

from drivers.camera.sources import container
from drivers.camera.sources.jitter_filter import SenderClock
from groundstation.bus import clock

MS = 1_000_000


def packet(shown_ms, sent_ms):
    made = av.Packet(b"picture")
    made.time_base, made.pts, made.dts = Fraction(1, 1000), shown_ms, sent_ms
    return made


def settled_ms(monkeypatch, packets):
    """Return the settled times of packets of 25 pictures a second that take 100 ms, every fifth 50 ms more."""
    jitter_filter, times = SenderClock(), []
    for index, one in enumerate(packets):
        arrival_ms = 40 * index + 100 + 50 * (index % 5 == 4)
        monkeypatch.setattr(clock, "now_ns", lambda ms=arrival_ms: ms * MS)
        (unit,) = container._units(one, lambda data, _: data, jitter_filter)
        times.append(unit.settled_ns / MS)
    return times


@pytest.mark.parametrize("shown", [(0, 0, 0, 0), (120, -40, -40, -40)])
def test_pictures_that_are_sent_in_another_order_than_shown_have_the_times_of_their_sending(monkeypatch, shown):
    packets = [packet(40 * index + shown[index % 4], 40 * index) for index in range(40)]
    assert settled_ms(monkeypatch, packets) == [40 * index + 100 for index in range(40)]


def test_a_packet_without_a_time_has_that_of_its_arrival(monkeypatch):
    packets = [packet(40 * index, None) for index in range(10)]
    assert settled_ms(monkeypatch, packets)[4:6] == [310, 300]

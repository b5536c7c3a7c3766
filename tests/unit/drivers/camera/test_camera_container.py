"""Packets that ffmpeg reads: their times, and devices that have none for a while, or for ever."""

import itertools
import threading
from fractions import Fraction
from typing import Any

import av
import pytest

from drivers.camera.sources import container
from drivers.camera.sources.jitter_filter import SenderClock
from groundstation.bus import clock
from groundstation.errors import DriverError

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


class Device:
    """A device opened without blocking: packets, None while there is none, and no more after the last."""

    def __init__(self, packets):
        self.waiting = iter(packets)

    def demux(self):
        while (one := next(self.waiting, None)) is not None:
            yield one
        raise av.BlockingIOError(11, "Resource temporarily unavailable")


class Video:
    index = 0


class Drain:
    def __init__(self):
        self.stop = threading.Event()
        self.wait = self.stop.wait

    @property
    def closing(self):
        return self.stop.is_set()


def packets_of(device, drain=None):
    arguments: list[Any] = [device, Video, Drain() if drain is None else drain]
    return container._packets(*arguments)


def test_a_device_without_a_picture_yet_is_asked_again():
    first, second = packet(0, 0), packet(40, 40)
    packets = packets_of(Device([None, None, first, None, second]))
    assert list(itertools.islice(packets, 2)) == [first, second]


def test_a_device_that_hangs_is_given_up(monkeypatch):
    monkeypatch.setattr(container, "_READ_LIMIT_S", 0.1)
    packets = packets_of(Device([packet(0, 0)]))
    next(packets)
    with pytest.raises(DriverError, match="no picture for"):
        next(packets)


def test_reading_a_device_that_hangs_can_be_ended():
    drain = Drain()
    threading.Timer(0.05, drain.stop.set).start()
    assert not list(packets_of(Device([]), drain))


def test_devices_are_opened_without_blocking():
    reader = container.device("/dev/video0", (640, 480))
    for choice in reader._choices:
        with av.open("testsrc", format="lavfi", options={"fflags": choice["fflags"]}) as opened:
            assert opened.flags & 4, "AVFMT_FLAG_NONBLOCK"

"""The datagram link: recipients of datagrams, refusals, and the effect of a recipient's error."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing

import pytest

from drivers.datagram_link import DatagramLink, Take
from drivers.datagrams import DatagramLog, unpack
from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.topics import RAW_RX, RAW_TX
from groundstation.errors import DriverError

HERE = "127.0.0.1"


class RefusedError(ValueError):
    reason = "too_short"


@pytest.fixture
def vehicle() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind((HERE, 0))
        udp.settimeout(5.0)
        yield udp


def link_to(vehicle: socket.socket, *takers: Take, exchange: MemoryExchange | None = None) -> DatagramLink:
    bus = MemoryBus(exchange or MemoryExchange(), "lab", "drone_1")
    ports = {(f"127.0.0.{2 + number}", 0): take for number, take in enumerate(takers)}
    return DatagramLink(DatagramLog(bus, "drone_1"), vehicle.getsockname(), ports)


def until_refused(link: DatagramLink, reason: str) -> None:
    deadline = time.monotonic() + 5.0
    while reason not in link.health(clock.now_ns()).rejected and time.monotonic() < deadline:
        time.sleep(0.005)
    assert link.health(clock.now_ns()).rejected[reason] == 1


def test_it_speaks_from_its_first_port_and_hears_only_the_vehicle(vehicle: socket.socket) -> None:
    heard, came = list[bytes](), threading.Event()

    def take(now_ns: int, data: bytes) -> bool:
        heard.append(data)
        came.set()
        return True

    with closing(link_to(vehicle, take, lambda now_ns, data: False)) as link:
        link.send(clock.now_ns(), b"hello")
        data, source = vehicle.recvfrom(100)
        assert (data, source[0]) == (b"hello", "127.0.0.2")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.sendto(b"strange", source)
        vehicle.sendto(b"known", source)
        assert came.wait(5.0)
    assert heard == [b"known"]


def test_refused_datagrams_are_counted_and_errors_of_the_recipient_survived(vehicle: socket.socket) -> None:
    last = threading.Event()

    def take(now_ns: int, data: bytes) -> bool:
        match data:
            case b"short":
                raise RefusedError
            case b"odd":
                raise ValueError("odd")
            case b"fault":
                raise ZeroDivisionError
        last.set()
        return True

    with closing(link_to(vehicle, take)) as link:
        link.send(clock.now_ns(), b"hello")
        _, source = vehicle.recvfrom(100)
        for data, reason in ((b"short", "too_short"), (b"odd", "unreadable"), (b"fault", "internal")):
            vehicle.sendto(data, source)
            until_refused(link, reason)
        assert link.health(clock.now_ns()).rate_hz == 0.0, "nothing refused is a report"
        vehicle.sendto(b"good", source)
        assert last.wait(5.0)


def test_the_rate_is_that_of_reports_and_none_when_they_end(vehicle: socket.socket) -> None:
    with closing(link_to(vehicle, lambda now_ns, data: data == b"report")) as link:
        period_ns, now_ns = 50_000_000, 1_000_000_000
        for number in range(80):
            link._hand_on(now_ns + number * period_ns, b"report", lambda now_ns, data: True)
            link._hand_on(now_ns + number * period_ns + 1, b"answer", lambda now_ns, data: False)
        ended_ns = now_ns + 79 * period_ns
        assert link.health(ended_ns).rate_hz == pytest.approx(20.0, rel=0.01)
        assert link.health(ended_ns + 400_000_000).rate_hz == 0.0


def test_datagrams_of_both_directions_are_recorded(vehicle: socket.socket) -> None:
    exchange, came = MemoryExchange(), threading.Event()
    raw = MemoryBus(exchange, "lab", "recorder").subscribe([RAW_RX, RAW_TX])

    def take(now_ns: int, data: bytes) -> bool:
        came.set()
        return True

    with closing(link_to(vehicle, take, exchange=exchange)) as link:
        link.send(7, b"hello")
        vehicle.sendto(b"report", vehicle.recvfrom(100)[1])
        assert came.wait(5.0)
    told = {received.key.topic: unpack(received.payload) for received in raw.drain()}
    assert told[RAW_TX] == [(7, b"hello")]
    assert [data for _, data in told[RAW_RX]] == [b"report"]


def test_a_port_that_cannot_be_had_leaves_none_open(vehicle: socket.socket) -> None:
    log = DatagramLog(MemoryBus(MemoryExchange(), "lab", "drone_1"), "drone_1")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.2", 0))
        port = probe.getsockname()[1]
    takers: dict[tuple[str, int], Take] = {("127.0.0.2", port): lambda *_: True, ("192.0.2.1", 0): lambda *_: True}
    with pytest.raises(DriverError, match=r"192\.0\.2\.1"):
        DatagramLink(log, vehicle.getsockname(), takers)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind(("127.0.0.2", port))


def test_a_port_that_hears_nothing_takes_what_the_vehicle_sends_from_another(
    vehicle: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("drivers.datagram_link._SEEKS_NS", 100_000_000)
    states, came = list[bytes](), threading.Event()

    def take(now_ns: int, data: bytes) -> bool:
        states.append(data)
        came.set()
        return True

    with (
        closing(link_to(vehicle, lambda now_ns, data: False, take)) as link,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        other.bind((HERE, 0))
        stranger.bind(("127.0.0.9", 0))
        ports = [udp.getsockname() for udp in link._takers]
        other.sendto(b"early", ports[1])
        time.sleep(0.3)
        assert not link._seeking, "the vehicle has not answered yet"
        link.send(clock.now_ns(), b"hello")
        vehicle.sendto(b"ok", vehicle.recvfrom(100)[1])
        deadline = time.monotonic() + 5.0
        while not came.is_set() and time.monotonic() < deadline:
            stranger.sendto(b"strange", ports[1])
            other.sendto(b"state", ports[1])
            time.sleep(0.02)
        assert came.is_set() and not link._seeking
        vehicle.sendto(b"ok", ports[0])
        vehicle.sendto(b"from its usual port", ports[1])
        time.sleep(0.3)
    assert set(states) == {b"state"}


def test_a_port_that_hears_the_vehicle_stays_with_it(vehicle: socket.socket, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.datagram_link._SEEKS_NS", 100_000_000)
    with closing(link_to(vehicle, lambda *_: False, lambda *_: True)) as link:
        opened = list(link._takers)
        for port in (udp.getsockname() for udp in opened):
            vehicle.sendto(b"ok", port)
        time.sleep(0.5)
        assert list(link._takers) == opened

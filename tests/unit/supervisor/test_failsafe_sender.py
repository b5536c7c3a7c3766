"""The substitute of silent drivers: whom it sends to, and that one transport that fails silences no other."""

import socket
import sys
import time
import types
from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest
from dummy_table import spec, until

from groundstation.supervisor.failsafe_sender import FailsafeSender
from groundstation.supervisor.process_spec import FailsafeDatagrams
from groundstation.supervisor.supervisor import Supervisor


class _Failing:
    def send(self, datagram: bytes, addresses: object) -> None:
        raise ValueError("a fault of another package")

    def close(self) -> None:
        pass


@pytest.fixture
def drone() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        made.setblocking(False)
        yield made


def datagrams(drone: socket.socket, transport: str = "") -> FailsafeDatagrams:
    usual = FailsafeDatagrams("127.0.0.1", drone.getsockname()[1], b"hover", b"land", land_after_s=3.0)
    return replace(usual, transport=transport) if transport else usual


def heard(drone: socket.socket) -> list[bytes]:
    found = []
    while True:
        try:
            found.append(drone.recv(100))
        except BlockingIOError:
            return found


def test_a_transport_that_fails_silences_no_other(drone: socket.socket, monkeypatch: pytest.MonkeyPatch) -> None:
    kind = types.ModuleType("failing_kind")
    kind.opens = lambda datagrams, speaker: _Failing()  # type: ignore[attr-defined]
    kind.fails = lambda datagrams, speaker: 1 / 0  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "failing_kind", kind)
    sender = FailsafeSender()
    assert sender.prepare("drone_3", datagrams(drone, "failing_kind:fails")) == "division by zero"
    sender.begin("drone_1", datagrams(drone, "failing_kind:opens"), time.monotonic_ns())
    sender.begin("drone_2", datagrams(drone), time.monotonic_ns())
    sender.send_due(time.monotonic_ns())
    sender.close()
    assert heard(drone) == [b"hover"]


@pytest.mark.parametrize("entry", ["crashing", "ends_its_work"])
def test_nobody_sends_to_a_vehicle_whose_driver_never_flew_it_or_has_ended_its_work(
    make: Callable[..., Supervisor], drone: socket.socket, entry: str
) -> None:
    driver = spec(
        "drone_1", entry, required=False, restart_delay_s=60.0, failsafe_datagrams=datagrams(drone), on_bus=False
    )
    supervisor = make(driver)
    supervisor.prepare()
    for process in supervisor.processes:
        supervisor.launch(process)
    ended = supervisor.processes[1]
    until(supervisor, lambda: ended.restart_due_ns is not None)
    for _ in range(20):
        supervisor.step()
    assert heard(drone) == []

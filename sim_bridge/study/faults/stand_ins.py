"""Stand-ins for clock, threads and sockets while the flight code runs in one thread."""

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from unittest.mock import patch

from drivers import vehicle_socket
from drivers.ardrone import driver as ardrone_driver
from groundstation.bus import clock
from sim_bridge.study.faults.memory_network import MemoryNetwork, NothingWaits


class HostedThread:
    """Stands in for a reader thread: `started` of them run when `read_all` calls them."""

    started: list["HostedThread"] = []  # noqa: RUF012 - its host empties it

    def __init__(self, target: Callable[[], None], name: str = "", daemon: bool = True) -> None:
        self.target, self.name, self.daemon = target, name, daemon

    def start(self) -> None:
        """Wait to be called."""
        HostedThread.started.append(self)

    def join(self, timeout: float | None = None) -> None:
        """Nothing to wait for."""


class NoTcp:
    """An AR.Drone whose TCP ports do not answer: neither a version nor a dump of its configuration."""

    version, dump, listening = "", b"", False

    def __init__(self, *_: object) -> None:
        """Take what a `TcpInquirer` takes."""

    def ask_version(self) -> None:
        """Answer nothing."""

    def ask_dump(self) -> None:
        """Answer nothing."""


def read_all(readers: list[HostedThread]) -> None:
    """Let each reader take its waiting datagrams."""
    with patch.object(vehicle_socket, "waits", lambda udp, _seconds: udp.waits()):
        for reader in readers:
            with suppress(NothingWaits):
                reader.target()


@contextmanager
def manual_clock(now_ns: Callable[[], int]) -> Iterator[None]:
    """Replace the host's clock in this process."""
    with patch.object(clock, "now_ns", now_ns):
        yield


@contextmanager
def in_memory(network: MemoryNetwork) -> Iterator[list[HostedThread]]:
    """Give drivers and emulators that are built inside the network in memory; yields the drivers' readers."""
    readers: list[HostedThread] = []
    HostedThread.started = readers
    with (
        patch.object(socket, "socket", network.socket),
        patch.object(threading, "Thread", HostedThread),
        patch.object(ardrone_driver, "TcpInquirer", NoTcp),
    ):
        yield readers

"""Transports of failsafe datagrams: plain UDP, or that of the drone's driver package for its links."""

from collections.abc import Callable, Sequence
from pkgutil import resolve_name
from typing import Protocol, runtime_checkable

from groundstation.adapters import Address, UdpSender
from groundstation.supervisor.process_spec import FailsafeDatagrams


class FailsafeTransport(Protocol):
    """Sends datagrams to all addresses of a link; `send` raises OSError on failure."""

    def send(self, datagram: bytes, addresses: Sequence[Address]) -> None:
        """Send a datagram to each address."""

    def close(self) -> None:
        """Release its resources; idempotent."""


@runtime_checkable
class Successor(FailsafeTransport, Protocol):
    """A transport that continues from the number that the driver recorded (`Child.leave`)."""

    def go_on_from(self, left: int) -> None:
        """Take the number that the driver recorded, 0 for none; called each time before it sends for the driver."""


def open_transport(datagrams: FailsafeDatagrams, speaker: int) -> FailsafeTransport:
    """Return the transport of one link; raises the driver package's error for an unusable link."""
    if not datagrams.transport:
        return UdpSender(datagrams.interface)
    # By name, as drivers are started: the supervisor knows no protocols.
    make: Callable[[str, int], FailsafeTransport] = resolve_name(datagrams.transport)
    return make(datagrams.way, speaker)

"""The interface between the driver and a link: the driver sends and receives messages, the link carries them."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from drivers.mavlink.links.refusals import LinkRefusals
from drivers.mavlink.wire.frames import Message, ReceivedFrame
from groundstation.adapters import Address

Sniffer = Callable[[int, int, bytes, bool], None]  # system, stamp_ns, bytes, received


class Heard(NamedTuple):
    """A frame and its arrival."""

    stamp_ns: int
    frame: ReceivedFrame


class MavlinkLink(Protocol):
    """One port with any number of vehicles behind it. Nothing that arrives raises; refusals are counted by reason."""

    rejected: LinkRefusals

    @property
    def called_from(self) -> tuple[Address, ...]:
        """Return the last addresses of the vehicles, on a link that they call themselves; empty on others."""

    @property
    def newest_stamp(self) -> int:
        """Return the newest time of signing, received or sent [10 us since 2015-01-01 UTC]; 0 on an unsigned link."""

    def receive(self) -> list[Heard]:
        """Wait up to 0.1 s; return the messages received."""

    def send(self, system: int, message: Message) -> None:
        """Send to one vehicle; never blocks; a message to a vehicle that never sent may be lost."""

    def close(self) -> None:
        """Close the port."""


class Transport(MavlinkLink, Protocol):
    """A link that also carries raw frames, encoded and decoded by somebody else."""

    def receive(self) -> list[Heard]:
        """Wait up to 0.1 s; return the messages received."""
        return [heard for heard, _ in self.receive_raw()]

    def receive_raw(self) -> list[tuple[Heard, bytes]]:
        """Wait up to 0.1 s; return the messages received, and the bytes of each frame."""

    def send_raw(self, system: int, data: bytes) -> None:
        """Send whole frames to one vehicle; never blocks."""


def ignore_bytes(system: int, stamp_ns: int, data: bytes, received: bool) -> None:
    """Ignore all traffic."""

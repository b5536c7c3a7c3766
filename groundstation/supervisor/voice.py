"""What carries fail-safe datagrams to a drone: plain UDP, or what the drone's driver package offers for its links."""

import importlib
import socket
from collections.abc import Callable, Sequence
from typing import Protocol

from groundstation.supervisor.process_spec import FailsafeDatagrams

Address = tuple[str, int]


class Voice(Protocol):
    """Says datagrams to all addresses of a link; `say` raises OSError where that fails."""

    def say(self, datagram: bytes, addresses: Sequence[Address]) -> None:
        """Send a datagram to each address."""

    def close(self) -> None:
        """Release what it holds; idempotent."""


class UdpVoice:
    """Datagrams as they are, from a port of its own."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def say(self, datagram: bytes, addresses: Sequence[Address]) -> None:
        """Send a datagram to each address."""
        for address in addresses:
            self._socket.sendto(datagram, address)

    def close(self) -> None:
        """Close the socket; idempotent."""
        self._socket.close()


def open_voice(words: FailsafeDatagrams, speaker: int) -> Voice:
    """Return what carries the words of one link; raises what a driver package raises for a link that it cannot use."""
    if not words.voice:
        return UdpVoice()
    # By name, as drivers are started: the supervisor knows no protocol.
    module, _, name = words.voice.partition(":")
    make: Callable[[str, int], Voice] = getattr(importlib.import_module(module), name)
    return make(words.way, speaker)

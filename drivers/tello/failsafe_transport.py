"""Lets supervisor and guardian stop and land a Tello whose driver is dead."""

import socket
from collections.abc import Sequence

from drivers.tello.wire.text import CENTRED, LAND
from groundstation.adapters import Address, bind_to_adapter, send_to_all


class TelloFailsafe:
    """Datagrams from a port of its own; `land` never without `rc 0 0 0 0` before it. way: the network adapter."""

    def __init__(self, way: str, speaker: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        bind_to_adapter(self._socket, way)
        self._socket.setblocking(False)

    def send(self, datagram: bytes, addresses: Sequence[Address]) -> None:
        """Send a datagram to each address."""
        # WIRE (docs/reference/tello.md 2): the last sticks stay in force, also while it lands.
        send_to_all(self._socket, (CENTRED, LAND) if datagram == LAND else (datagram,), addresses)

    def close(self) -> None:
        """Close the socket; idempotent."""
        self._socket.close()

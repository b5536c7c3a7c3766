"""Lets supervisor and guardian stop and land a Tello whose driver is dead."""

from collections.abc import Sequence

from drivers.tello.wire.text import CENTRED, LAND
from groundstation.adapters import Address, UdpSender, send_to_all


class TelloFailsafe(UdpSender):
    """Sends `land` never without `rc 0 0 0 0` before it. way: the network adapter."""

    def __init__(self, way: str, speaker: int) -> None:
        super().__init__(way)

    def send(self, datagram: bytes, addresses: Sequence[Address]) -> None:
        """Send a datagram to each address; raises the last OSError after all have been tried."""
        # WIRE (docs/reference/tello.md 2): the last sticks stay in force, also while it lands.
        send_to_all(self._socket, (CENTRED, LAND) if datagram == LAND else (datagram,), addresses)

"""The access for devices in the network: one more socket, over TLS, beside the console's own on loopback."""

import asyncio.constants
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from groundstation.console.access import DeviceDoor
from groundstation.console.devices import Devices
from groundstation.console.half_open import PATIENCE_S


@dataclass(frozen=True, slots=True)
class Network:
    """A listening socket, its server's certificate and key, and the admitted devices."""

    listener: socket.socket
    certificate: Path
    key: Path
    door: DeviceDoor

    @classmethod
    def over(cls, listener: socket.socket, devices: Devices) -> Self:
        """Return the access of devices at a listening socket."""
        # uvicorn hands no time-out on, and 60 s of silence before TLS would let few strangers use all descriptors up.
        vars(asyncio.constants)["SSL_HANDSHAKE_TIMEOUT"] = PATIENCE_S
        address, port = listener.getsockname()
        return cls(listener, *devices.open(address, port), DeviceDoor(devices, address))

"""The datagram socket of a vehicle's link."""

import os
import select
import socket

from groundstation.adapters import Address, bind_to_adapter
from groundstation.errors import DriverError
from groundstation.process.ports import why_refused


def open_udp(
    local: Address, interface: str = "", peer: Address | None = None, *, shares: bool = False
) -> socket.socket:  # fmt: skip
    """Return a datagram socket on an own address ("": any) and port (0: any free), through one adapter ("": any).

    With a peer it receives from that only, and several sockets may share the port, each with a peer of its own; one
    that shares it without a peer gets what is for none of those. Raises DriverError if the port is taken (naming its
    holder), the peer unreachable, or the adapter unknown.
    """
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bind_to_adapter(one, interface)
    address, port = local
    place = f"{address or '*'}:{port or 'any'} (UDP)"
    try:
        if peer is not None or shares:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        one.bind(local)
    except OSError as error:
        one.close()
        raise DriverError(f"cannot bind {place}: {why_refused(error, address, port, socket.SOCK_DGRAM)}") from error
    try:
        if peer is not None:
            one.connect(peer)
    except OSError as error:
        one.close()
        raise DriverError(f"no way from {place} to {peer}: {os.strerror(error.errno or 0)}") from error
    return one


def waits(udp: socket.socket, seconds: float) -> bool:
    """Wait for a datagram up to a time, and return whether one is there; so the socket itself needs no time limit.

    Such a limit would apply to sending too: 0.1 s for each frame while the buffer is full.
    """
    return bool(select.select([udp], [], [], seconds)[0])

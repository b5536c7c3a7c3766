"""Opens ports of the simulator, and composes the error message for ports in use."""

import socket

from groundstation.errors import GroundStationError
from groundstation.process.ports import why_refused


def refused(owner: str, address: str, port: int, kind: socket.SocketKind, error: OSError) -> GroundStationError:
    """Return the error for a port that the simulator cannot have; owner: its part, as the sentence begins."""
    protocol = "TCP" if kind is socket.SOCK_STREAM else "UDP"
    why = why_refused(error, address, port, kind)
    return GroundStationError(f"{owner}: cannot listen on {address}:{port} ({protocol}): {why}")


def open_udp(owner: str, address: str, port: int) -> socket.socket:
    """Return a bound datagram socket that never blocks; raises GroundStationError naming a port that is taken."""
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.setblocking(False)
    try:
        udp.bind((address, port))
    except OSError as error:
        udp.close()
        raise refused(owner, address, port, socket.SOCK_DGRAM, error) from error
    return udp

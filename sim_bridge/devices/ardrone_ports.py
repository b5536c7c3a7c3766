"""The lesser ports of an emulated AR.Drone: configuration dump, version file, pairing."""

import selectors
import socket
from contextlib import suppress

from drivers.ardrone.wire.configuration import format_custom_dump, format_dump
from groundstation.errors import GroundStationError
from sim_bridge.devices.ardrone_config import Configuration
from sim_bridge.devices.ardrone_ftp import FtpServer
from sim_bridge.devices.ardrone_tcp import Connection, Selector, TcpPort
from sim_bridge.listening import open_udp

CONTROL_PORT = 5559
VERSION_PORT = 5551
DATA_PORT = 21
PAIRING_PORT = 5552
_PAIRING_DATAGRAMS = 8


class ControlPort:
    """TCP 5559: sends the configuration to all clients when CTRL requests it."""

    def __init__(self, name: str, address: str, selector: Selector) -> None:
        self._port = TcpPort(name, address, CONTROL_PORT, selector, _Deaf)

    @property
    def connected(self) -> bool:
        """Return whether a client is connected."""
        return any(connection.open for connection in self._port.connections)

    def dump(self, configuration: Configuration) -> None:
        """Send all keys and values in force."""
        self._send(format_dump(configuration.values))

    def custom_dump(self, configuration: Configuration) -> None:
        """Send ids and descriptions of all sets."""
        self._send(format_custom_dump(configuration.descriptions))

    def close(self) -> None:
        """Close the port; idempotent."""
        self._port.close()

    def _send(self, text: bytes) -> None:
        for connection in self._port.connections:
            connection.send(text)


class _Deaf:
    """The control port ignores its input: AT commands request its output."""

    def __init__(self, connection: Connection) -> None:
        pass

    def take(self, data: bytes) -> None:
        """Ignore the input."""

    def end(self) -> None:
        """Nothing belongs to it."""


class Pairing:
    """UDP 5552: accepts every request to pair. WIRE: `PARROT AUTH`, answered by `PARROT AUTH OK`."""

    def __init__(self, name: str, address: str, selector: Selector) -> None:
        self._selector = selector
        self._udp = open_shared_udp(name, address, PAIRING_PORT)
        selector.register(self._udp, selectors.EVENT_READ, self._answer)

    def close(self) -> None:
        """Close the port."""
        self._selector.unregister(self._udp)
        self._udp.close()

    def _answer(self, _mask: int) -> None:
        with suppress(OSError):
            for _ in range(_PAIRING_DATAGRAMS):
                datagram, client = self._udp.recvfrom(64)
                if datagram.startswith(b"PARROT AUTH"):
                    self._udp.sendto(b"PARROT AUTH OK", client)


class Ports:
    """All lesser ports; port 21 only where the operating system permits it."""

    def __init__(self, name: str, address: str, selector: Selector, version: str) -> None:
        self._opened: list[ControlPort | FtpServer | Pairing] = []
        try:
            self.control = ControlPort(name, address, selector)
            self._opened.append(self.control)
            files = {"version.txt": f"{version}\n".encode()}
            self._opened.append(FtpServer(name, address, VERSION_PORT, selector, files))
            self._opened.append(Pairing(name, address, selector))
        except GroundStationError:
            self.close()
            raise
        with suppress(GroundStationError):
            self._opened.append(FtpServer(name, address, DATA_PORT, selector, {}))

    def close(self) -> None:
        """Close them."""
        for port in self._opened:
            port.close()
        self._opened.clear()


def open_shared_udp(name: str, address: str, port: int) -> socket.socket:
    """Return a bound datagram socket that never blocks; raises GroundStationError naming a port that is taken."""
    udp = open_udp(f"emulated {name}", address, port)
    # Set after binding: nobody else gets this address, but old clients, which bind the same port on all addresses of
    # the host, get it if they ask for sharing, too.
    udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    return udp

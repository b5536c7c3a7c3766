"""A TCP connection for a reader of a stream: with bounded waits, and interruptible from another thread."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from groundstation.adapters import connected, with_zone

_CONNECT_TIMEOUT_S = 2.0
_READ_TIMEOUT_S = 2.0


class Line:
    """Opens one connection after the other to the same place, through one network adapter, or any ("")."""

    def __init__(self, host: str, port: int, interface: str = "") -> None:
        self.address = (host, port)
        self._interface = interface
        self._socket: socket.socket | None = None

    @property
    def name(self) -> str:
        """Return host:port, or host%adapter:port."""
        return f"{with_zone(self.address[0], self._interface)}:{self.address[1]}"

    @contextmanager
    def open(self) -> Iterator[socket.socket]:
        """Yield a fresh connection whose reads end after 2 s; raises OSError, or DriverError for the adapter."""
        with connected(self.address, _CONNECT_TIMEOUT_S, self._interface) as connection:
            connection.settimeout(_READ_TIMEOUT_S)
            self._socket = connection
            try:
                yield connection
            finally:
                self._socket = None

    def interrupt(self) -> None:
        """End the connection, from any thread."""
        connection = self._socket
        if connection is not None:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

"""TCP ports of an emulated drone that never block: connections answer bytes with bytes."""

import selectors
import socket
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from sim_bridge.listening import refused

_MOST_CONNECTIONS = 8
_LARGEST_BACKLOG = 1 << 18
_CHUNK = 4096

Selector = selectors.BaseSelector


class Conversation(Protocol):
    """The protocol of one connection."""

    def take(self, data: bytes) -> None:
        """Take the client's bytes."""

    def end(self) -> None:
        """Release its resources; the connection is closed."""


class Connection:
    """One accepted connection. The selector calls its handlers with a mask of events."""

    def __init__(self, stream: socket.socket, selector: Selector) -> None:
        stream.setblocking(False)
        self.stream = stream
        self.conversation: Conversation | None = None
        self.open = True
        self._selector = selector
        self._pending = bytearray()
        self._closing = False
        selector.register(stream, selectors.EVENT_READ, self._serve)

    def send(self, data: bytes) -> None:
        """Send at the client's pace; a client that takes nothing while much waits is dropped."""
        if not self.open:
            return
        self._pending += data
        self._flush()
        if len(self._pending) > _LARGEST_BACKLOG:
            self.close()

    def close_when_sent(self) -> None:
        """Close after the last byte is out."""
        self._closing = True
        self._flush()

    def close(self) -> None:
        """Close at once; idempotent."""
        if not self.open:
            return
        self.open = False
        self._selector.unregister(self.stream)
        self.stream.close()
        if self.conversation is not None:
            self.conversation.end()

    def _serve(self, mask: int) -> None:
        if mask & selectors.EVENT_WRITE:
            self._flush()
        if self.open and mask & selectors.EVENT_READ:
            try:
                data = self.stream.recv(_CHUNK)
            except BlockingIOError:
                return
            except OSError:
                data = b""
            if not data:
                self.close()
            elif self.conversation is not None:
                self.conversation.take(data)

    def _flush(self) -> None:
        if not self.open:
            return
        try:
            while self._pending:
                del self._pending[: self.stream.send(self._pending)]
        except BlockingIOError:
            pass
        except OSError:
            self.close()
            return
        if self._closing and not self._pending:
            self.close()
            return
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if self._pending else 0)
        self._selector.modify(self.stream, wanted, self._serve)


class TcpPort:
    """A listening port; `greet` returns the conversation of each accepted connection."""

    def __init__(
        self, name: str, address: str, port: int, selector: Selector, greet: Callable[[Connection], Conversation]
    ) -> None:
        self.connections: list[Connection] = []
        self._selector, self._greet = selector, greet
        self._listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._listener.setblocking(False)
        try:
            self._listener.bind((address, port))
            self._listener.listen(_MOST_CONNECTIONS)
        except OSError as error:
            self._listener.close()
            raise refused(f"emulated {name}", address, port, socket.SOCK_STREAM, error) from error
        self.address: tuple[str, int] = self._listener.getsockname()
        selector.register(self._listener, selectors.EVENT_READ, self._accept)

    def close(self) -> None:
        """Close the port and all its connections; idempotent."""
        for connection in self.connections:
            connection.close()
        self.stop_listening()

    def stop_listening(self) -> None:
        """Close the port alone: accepted connections live on; idempotent."""
        if self._listener.fileno() >= 0:
            self._selector.unregister(self._listener)
            self._listener.close()

    def _accept(self, _mask: int) -> None:
        with suppress(OSError):
            stream, _ = self._listener.accept()
            self.connections = [each for each in self.connections if each.open]
            if len(self.connections) >= _MOST_CONNECTIONS:
                stream.close()
                return
            connection = Connection(stream, self._selector)
            self.connections.append(connection)
            connection.conversation = self._greet(connection)

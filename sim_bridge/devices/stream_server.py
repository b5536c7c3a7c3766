"""A TCP server that sends pictures to several clients at set times; a slow client delays no other.

The greeting of clients, and the meaning of their bytes, are up to the kinds of streams built on it.
"""

import errno
import heapq
import selectors
import socket
import threading
import time
from contextlib import suppress

_MAX_CLIENTS = 8
_MAX_QUEUED = 64
_POLL_S = 0.25


class Client:
    """One connection; `starved`: it waits for a picture that can be decoded alone."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.request = b""
        self.pending = memoryview(b"")
        self.streaming = False
        self.closing = False
        self.starved = True


class StreamServer:
    """Serves from a thread of its own; `close` ends it.

    A client that is still busy with an earlier picture misses the next ones, up to one that can stand alone.
    """

    def __init__(self, address: str, port: int) -> None:
        self._listener = socket.create_server((address, port), backlog=16)
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._waker, self._wake_end = socket.socketpair()
        self._wake_end.setblocking(False)
        self._selector.register(self._wake_end, selectors.EVENT_READ)
        self._clients: dict[int, Client] = {}
        self._queue: list[tuple[int, int, bytes, bool]] = []
        self._lock = threading.Lock()
        self._count = 0
        self._accepting = True
        self._running = True
        self.frames_sent = 0
        self._thread = threading.Thread(target=self._serve, name="camera-stream", daemon=True)
        self._thread.start()

    @property
    def clients(self) -> int:
        """Return how many clients are connected."""
        return len(self._clients)

    def set_accepting(self, accepting: bool) -> None:
        """Refuse new clients and cut the present ones (False), or serve again (True)."""
        if accepting != self._accepting:
            self._accepting = accepting
            self._wake()

    def close(self) -> None:
        """Stop serving and free the port; idempotent."""
        if not self._running:
            return
        self._running = False
        self._wake()
        self._thread.join(timeout=2.0)
        for client in list(self._clients.values()):
            self._drop(client)
        self._selector.close()
        for end in (self._listener, self._waker, self._wake_end):
            end.close()

    def _greet(self, client: Client) -> None:
        """Meet a new client."""
        raise NotImplementedError

    def _hear(self, client: Client, data: bytes) -> bool:
        """Take a client's bytes; False: drop the client."""
        raise NotImplementedError

    def _hand_over(self, release_ns: int, payload: bytes, stands_alone: bool) -> None:
        """Hand bytes to all clients at a monotonic time [ns]; they leave in the order of their times."""
        with self._lock:
            self._count += 1
            heapq.heappush(self._queue, (release_ns, self._count, payload, stands_alone))
            del self._queue[_MAX_QUEUED:]
            is_next = self._queue[0][1] == self._count
        if is_next:  # else the thread wakes before it is due
            self._wake()

    def _wake(self) -> None:
        with suppress(OSError):
            self._waker.send(b"x")

    def _serve(self) -> None:
        while self._running:
            for key, events in self._selector.select(self._patience_s()):
                if key.fileobj is self._listener:
                    self._accept()
                elif key.fileobj is self._wake_end:
                    with suppress(OSError):
                        self._wake_end.recv(4096)
                elif (client := self._clients.get(key.fd)) is not None:
                    self._serve_client(client, events)
            if not self._accepting:
                for client in list(self._clients.values()):
                    self._drop(client)
            self._release_due()

    def _patience_s(self) -> float:
        with self._lock:
            due_ns = self._queue[0][0] if self._queue else None
        if due_ns is None:
            return _POLL_S
        return min(_POLL_S, max(0.0, (due_ns - time.monotonic_ns()) / 1e9))

    def _release_due(self) -> None:
        now_ns = time.monotonic_ns()
        while True:
            with self._lock:
                if not self._queue or self._queue[0][0] > now_ns:
                    return
                _, _, payload, stands_alone = heapq.heappop(self._queue)
            self.frames_sent += 1
            for client in list(self._clients.values()):
                if client.streaming and not client.closing:
                    self._give(client, payload, stands_alone)

    def _give(self, client: Client, payload: bytes, stands_alone: bool) -> None:
        client.starved = bool(client.pending) or (client.starved and not stands_alone)
        if not client.starved:
            client.pending = memoryview(payload)
            self._flush(client)

    def _accept(self) -> None:
        with suppress(BlockingIOError, ConnectionError):
            connection, _ = self._listener.accept()
            if not self._accepting or len(self._clients) >= _MAX_CLIENTS:
                connection.close()
                return
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            # A small buffer in the kernel: a slow client sees few old frames, not seconds of them.
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 18)
            client = self._clients[connection.fileno()] = Client(connection)
            self._selector.register(connection, selectors.EVENT_READ)
            self._greet(client)

    def _serve_client(self, client: Client, events: int) -> None:
        if events & selectors.EVENT_READ and not self._read(client):
            self._drop(client)
        elif events & selectors.EVENT_WRITE:
            self._flush(client)

    def _read(self, client: Client) -> bool:
        try:
            data = client.connection.recv(4096)
        except BlockingIOError:
            return True
        except OSError:
            return False
        return bool(data) and self._hear(client, data)

    def _flush(self, client: Client) -> None:
        try:
            while client.pending:
                client.pending = client.pending[client.connection.send(client.pending) :]
        except OSError as error:
            if error.errno not in (errno.EAGAIN, errno.EWOULDBLOCK):
                self._drop(client)
                return
        if client.closing and not client.pending:
            self._drop(client)
            return
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.pending else 0)
        with suppress(KeyError):
            self._selector.modify(client.connection, events)

    def _drop(self, client: Client) -> None:
        self._clients.pop(client.connection.fileno(), None)
        with suppress(KeyError, ValueError):
            self._selector.unregister(client.connection)
        client.connection.close()

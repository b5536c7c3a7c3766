"""TCP proxy to a local port: data no longer pass, or late, or slowly, and the connection stays open."""

import contextlib
import queue
import socket
import threading
import time

from free_port import free_port

_PIECE = 2048
_Piece = tuple[float, bytes]
"""When it is due, and what; nothing at the end, with the time 0 if that is not to be told."""


class StallingPipe:
    """TCP proxy; while `stalled` it accepts data and passes nothing on. A connection that has stalled stays dead.

    late_s: by how long it delays what the server says; bytes_per_s: how much of that it passes on, None for all.
    """

    def __init__(self, behind: int) -> None:
        self.stalled = threading.Event()
        self.late_s = 0.0
        self.bytes_per_s: float | None = None
        self._behind = behind
        self._listener = socket.create_server(("127.0.0.1", free_port()))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}/"
        self._threads = [threading.Thread(target=self._accept, daemon=True)]
        self._sockets = [self._listener]
        self._threads[0].start()

    def close(self) -> None:
        self.late_s, self.bytes_per_s = 0.0, None
        for each in self._sockets:
            with contextlib.suppress(OSError):  # it has ended by itself
                each.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join(5)
        for each in self._sockets:
            each.close()

    def _accept(self) -> None:
        while True:
            try:
                came, _ = self._listener.accept()
            except OSError:
                return
            # As small as the buffers of a slow radio: what waits, waits at the server.
            there = socket.socket()
            there.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 * _PIECE)
            there.connect(("127.0.0.1", self._behind))
            self._sockets += [came, there]
            dead = self.stalled.is_set()
            delayed: queue.Queue[_Piece] = queue.Queue()
            for act, *ends in (
                (self._pass, came, there, dead),
                (self._take, there, delayed, dead),
                (self._give, delayed, came),
            ):
                self._threads.append(threading.Thread(target=act, args=ends, daemon=True))
                self._threads[-1].start()

    def _pass(self, source: socket.socket, sink: socket.socket, dead: bool) -> None:
        try:
            while data := source.recv(65536):
                dead = dead or self.stalled.is_set()
                if not dead:
                    sink.sendall(data)
            if not dead:
                sink.shutdown(socket.SHUT_WR)
        except OSError:
            pass  # the other direction has ended it

    def _take(self, source: socket.socket, delayed: "queue.Queue[_Piece]", dead: bool) -> None:
        with contextlib.suppress(OSError):  # the other direction has ended it
            while data := source.recv(_PIECE):
                dead = dead or self.stalled.is_set()
                if not dead:
                    time.sleep(len(data) / self.bytes_per_s if self.bytes_per_s else 0.0)
                    delayed.put((time.monotonic() + self.late_s, data))
        delayed.put((0.0 if dead else time.monotonic() + self.late_s, b""))

    @staticmethod
    def _give(delayed: "queue.Queue[_Piece]", sink: socket.socket) -> None:
        with contextlib.suppress(OSError):  # the page has gone
            while True:
                due_s, data = delayed.get()
                time.sleep(max(0.0, due_s - time.monotonic()))
                if not data:
                    return sink.shutdown(socket.SHUT_WR) if due_s else None
                sink.sendall(data)

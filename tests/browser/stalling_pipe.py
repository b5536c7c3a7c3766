"""TCP proxy to a local port that can stall: data no longer pass, and the connection stays open."""

import contextlib
import socket
import threading

from free_port import free_port


class StallingPipe:
    """TCP proxy; while `stalled` it accepts data and passes nothing on. A connection that has stalled stays dead."""

    def __init__(self, behind: int) -> None:
        self.stalled = threading.Event()
        self._behind = behind
        self._listener = socket.create_server(("127.0.0.1", free_port()))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}/"
        self._threads = [threading.Thread(target=self._accept, daemon=True)]
        self._sockets = [self._listener]
        self._threads[0].start()

    def close(self) -> None:
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
            there = socket.create_connection(("127.0.0.1", self._behind))
            self._sockets += [came, there]
            dead = self.stalled.is_set()
            for way in ((came, there, dead), (there, came, dead)):
                self._threads.append(threading.Thread(target=self._pass, args=way, daemon=True))
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

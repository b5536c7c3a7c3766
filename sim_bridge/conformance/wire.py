"""The wire between driver and emulated vehicle, with faults: damage, loss, disorder, a stranger's address.

All datagrams that Python sends or receives, asyncio's too, pass through a method of `socket.socket`. Those methods are
wrapped for the sockets at the vehicle's address, in all threads. Streams are left alone.
"""

import random
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from sim_bridge.conformance.damage import damaged

_SENDING = ("send", "sendto", "sendmsg")
_RECEIVING = ("recv", "recvfrom", "recvmsg", "recv_into", "recvfrom_into", "recvmsg_into")
# A datagram that was read into the caller's own buffer cannot be handed out later.
_HOLDABLE = frozenset(("recv", "recvfrom", "recvmsg"))
_KEPT = 100


class Wire:
    """A context that alters the datagrams of one vehicle; its attributes apply from the next datagram on.

    copies: damaged datagrams that follow each one of the vehicle; loss, swap: shares [0..1] of the datagrams of both
    directions that are lost, and that the next one overtakes; estranged: the vehicle's datagrams come from the
    stranger's address instead of its own. said, damaged: datagrams of the vehicle so far, and damaged copies.
    """

    def __init__(self, address: str, stranger: str) -> None:
        self.copies, self.loss, self.swap, self.estranged = 0, 0.0, 0.0, False
        self.said = self.damaged = 0
        self._address, self._stranger = address, stranger
        self._draw, self._lock = random.Random(1), threading.RLock()
        self._kept: list[tuple[int, Any, bytes]] = []
        self._strangers: dict[int, socket.socket] = {}
        self._late: dict[socket.socket, Callable[[], Any]] = {}
        self._overtaken: dict[socket.socket, Any] = {}
        self._due: dict[socket.socket, Any] = {}
        self._before: dict[str, Any] = {}

    def __enter__(self) -> Self:
        for name in (*_SENDING, *_RECEIVING):
            self._before[name] = vars(socket.socket).get(name)
            honest = getattr(socket.socket, name)
            watched = self._sender(honest) if name in _SENDING else self._receiver(honest, name in _HOLDABLE)
            setattr(socket.socket, name, watched)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for name, before in self._before.items():
            if before is None:
                delattr(socket.socket, name)
            else:
                setattr(socket.socket, name, before)
        for one in self._strangers.values():
            one.close()

    def repeat_as_stranger(self) -> None:
        """Send the vehicle's first datagrams once more, from the stranger's address."""
        with self._lock:
            for port, to, data in self._kept:
                self._say_as_stranger(port, to, data)

    def told_to_stranger(self) -> int:
        """Return the number of datagrams sent to the stranger since the last call."""
        count = 0
        for one in self._strangers.values():
            with suppress(BlockingIOError):
                while one.recv(65535):
                    count += 1
        return count

    def _port(self, one: socket.socket) -> int | None:
        """Return the vehicle's port that a socket is bound to; None for other sockets."""
        if one.family != socket.AF_INET or one.type != socket.SOCK_DGRAM:
            return None
        address, port = one.getsockname()
        return port if address == self._address else None

    def _strikes(self, share: float) -> bool:
        return share > 0.0 and self._draw.random() < share

    # -- from the vehicle ---------------------------------------------------------------------------------------------

    def _sender(self, honest: Any) -> Any:
        def send(speaker: socket.socket, data: Any, *rest: Any) -> Any:
            port = self._port(speaker)
            if port is None:
                return honest(speaker, data, *rest)
            parts = isinstance(data, list | tuple)
            content = b"".join(bytes(part) for part in data) if parts else bytes(data)
            to = rest[-1] if rest and isinstance(rest[-1], tuple) else speaker.getpeername()
            with self._lock:
                self._say(speaker, port, to, content, lambda said: honest(speaker, [said] if parts else said, *rest))
            return len(content)

        return send

    def _say(self, speaker: socket.socket, port: int, to: Any, content: bytes, say: Callable[[bytes], Any]) -> None:
        self.said += 1
        if len(self._kept) < _KEPT:
            self._kept.append((port, to, content))
        if self.estranged:
            self._say_as_stranger(port, to, content)
        elif not self._strikes(self.loss):
            self._in_disorder(speaker, lambda: say(content))
        for _ in range(self.copies):
            say(damaged(content, self._draw))
            self.damaged += 1

    def _in_disorder(self, speaker: socket.socket, say: Callable[[], Any]) -> None:
        late = self._late.pop(speaker, None)
        if late is None and self._strikes(self.swap):
            self._late[speaker] = say
            return
        say()
        if late is not None:
            late()

    def _say_as_stranger(self, port: int, to: Any, content: bytes) -> None:
        if port not in self._strangers:
            self._strangers[port] = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._strangers[port].setblocking(False)
            self._strangers[port].bind((self._stranger, port))
        with suppress(OSError):  # nobody listens there
            self._strangers[port].sendto(content, to)

    # -- to the vehicle -----------------------------------------------------------------------------------------------

    def _receiver(self, honest: Any, holdable: bool) -> Any:
        def receive(listener: socket.socket, *how: Any) -> Any:
            if self._port(listener) is None:
                return honest(listener, *how)
            if holdable and listener in self._due:
                return self._due.pop(listener)
            while True:
                heard = honest(listener, *how)
                if self._strikes(self.loss):
                    continue
                if holdable and listener in self._overtaken:
                    self._due[listener] = self._overtaken.pop(listener)
                elif holdable and self._strikes(self.swap):
                    self._overtaken[listener] = heard
                    continue
                return heard

        return receive

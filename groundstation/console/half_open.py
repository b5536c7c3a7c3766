"""Limits connections without a request: each has 5 s, and when there are too many the oldest one is closed.

A browser sends its request at once, so the oldest is never somebody's page; without this, a few hundred silent
connections keep everybody else out. From the network, the connections of one address are limited, silent or not.
"""

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

PATIENCE_S = 5.0
MOST = 64
MOST_OF_A_PEER = 24
"""A page has one lasting connection, and a browser opens at most six to load it."""


class HalfOpen:
    """The connections of one server without a request in progress; `ended` counts those that were closed for it."""

    def __init__(self, patience_s: float = PATIENCE_S, most: int = MOST) -> None:
        self._patience_s, self._most = patience_s, most
        self._waiting: dict[asyncio.Transport, asyncio.TimerHandle] = {}
        self.ended = 0

    def enter(self, transport: asyncio.Transport) -> None:
        """Begin to wait for a request; the time counts from the connection on, and is not renewed."""
        if transport in self._waiting:
            return
        loop = asyncio.get_running_loop()
        self._waiting[transport] = loop.call_later(self._patience_s, self._end, transport)
        if len(self._waiting) > self._most:
            self._end(next(iter(self._waiting)))

    def leave(self, transport: asyncio.Transport) -> None:
        """Stop waiting: a request came, or the connection has gone."""
        timer = self._waiting.pop(transport, None)
        if timer is not None:
            timer.cancel()

    def _end(self, transport: asyncio.Transport) -> None:
        self.leave(transport)
        self.ended += 1
        transport.abort()


class PeerLimit:
    """The open connections of each address; `refused` counts those beyond what one may have."""

    def __init__(self, most: int = MOST_OF_A_PEER) -> None:
        self._most = most
        self._open: dict[str, list[asyncio.Transport]] = {}
        self.refused = 0

    def enter(self, transport: asyncio.Transport) -> None:
        """Accept a connection, or close it."""
        for address in [each for each, theirs in self._open.items() if all(one.is_closing() for one in theirs)]:
            del self._open[address]
        theirs = self._open.setdefault(transport.get_extra_info("peername")[0], [])
        theirs[:] = [one for one in theirs if not one.is_closing()]
        if len(theirs) < self._most:
            theirs.append(transport)
        else:
            self.refused += 1
            transport.abort()


def protocol(waiting: HalfOpen, peers: PeerLimit | None = None) -> type[H11Protocol]:
    """Return uvicorn's HTTP protocol with the limit on silence and, if peers are given, with theirs."""

    class Impatient(H11Protocol):
        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            if peers is not None:
                peers.enter(transport)
            if not transport.is_closing():
                waiting.enter(transport)

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self.cycle is not None and not self.cycle.response_complete:
                waiting.leave(self.transport)
            elif not self.transport.is_closing() and self in self.connections:
                waiting.enter(self.transport)

        def handle_websocket_upgrade(self, event: Any) -> None:
            waiting.leave(self.transport)
            super().handle_websocket_upgrade(event)

        def connection_lost(self, exc: Exception | None) -> None:
            waiting.leave(self.transport)
            super().connection_lost(exc)

    return Impatient

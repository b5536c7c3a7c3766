"""A client of a ROS 2 Zenoh router: joins as soon as the router is there, and again after each loss.

The router would not broker a peer, and scouting would find other people's routers.
"""

import itertools
import json
import os
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import zenoh

from drivers.rmw_zenoh.wire import graph

_AGAIN_S, _PATIENCE_S = 0.5, 3.0
# key, payload, the publisher's 16 bytes
Hear = Callable[[str, bytes, bytes], None]


class RouterSession:
    """One client; expressions: keys whose messages `hear` gets, on a thread of the network.

    joined: called on another thread when the router is there, again where that failed; declares what else is needed.
    """

    def __init__(
        self,
        endpoint: str,
        expressions: Sequence[str],
        hear: Hear,
        joined: Callable[["RouterSession"], None] = lambda session: None,
    ) -> None:
        self.endpoint, self.zid = endpoint, ""
        self.is_open = False
        self._expressions, self._hear, self._joined = expressions, hear, joined
        self._session: Any = None
        self._declared: list[Any] = []
        self._tokens: set[str] = set()
        self._closing = threading.Event()
        self._joining = threading.Thread(target=self._join, name="ros2", daemon=True)
        self._joining.start()

    @property
    def reaches_router(self) -> bool:
        """Return whether the router is there at the moment."""
        return self.is_open and bool(list(self._session.info.routers_zid()))

    def declare(self, token: str) -> None:
        """Announce a node or publisher to the others until the session ends."""
        self._declared.append(self._session.liveliness().declare_token(token))

    def watch(self, expression: str) -> None:
        """Follow the tokens of others that an expression names; see `nodes`."""
        liveliness = self._session.liveliness()
        self._declared.append(liveliness.declare_subscriber(expression, self._follow, history=True))

    @property
    def nodes(self) -> tuple[str, ...]:
        """Return the names of the nodes that have a watched token, in order."""
        return tuple(sorted({graph.node_of(token) for token in self._tokens.copy()} - {""}))

    def _follow(self, sample: Any) -> None:
        change = self._tokens.add if sample.kind == zenoh.SampleKind.PUT else self._tokens.discard
        change(str(sample.key_expr))

    def publisher(self, key: str) -> "Publisher":
        """Return a publisher of a topic's key; the newest message goes first, and none waits for a full line."""
        dropping, first = zenoh.CongestionControl.DROP, zenoh.Priority.REAL_TIME
        return Publisher(
            self._session.declare_publisher(key, congestion_control=dropping, priority=first, express=True)
        )

    def caller(self, key: str, answered: Callable[[bytes], None]) -> "Caller":
        """Return a client of a service; answered: called with each answer's bytes, on a thread of the network."""
        return Caller(
            self._session.declare_querier(
                key, target=zenoh.QueryTarget.ALL, congestion_control=zenoh.CongestionControl.DROP, express=True
            ),
            answered,
        )

    def close(self) -> None:
        """Leave the router; idempotent."""
        self._closing.set()
        self._joining.join(_PATIENCE_S)
        self.is_open = False
        for one in self._declared:
            with suppress(zenoh.ZError):  # the router left first
                one.undeclare()
        self._leave()

    def _join(self) -> None:
        settings = {
            "mode": "client",
            "connect": {"endpoints": [self.endpoint], "timeout_ms": 1000, "exit_on_failure": True},
            "scouting": {"multicast": {"enabled": False}},
        }
        while not self._closing.is_set():
            try:
                self._session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
                self._declare_all()
            except zenoh.ZError:  # no router yet, or one that left during the declaration
                self._leave()
                self._closing.wait(_AGAIN_S)
            else:
                self.is_open = True
                return

    def _declare_all(self) -> None:
        self.zid = str(self._session.zid())
        self._joined(self)
        for expression in self._expressions:
            self._declared.append(self._session.declare_subscriber(expression, self._take))

    def _leave(self) -> None:
        self._declared.clear()
        self._tokens.clear()
        if self._session is not None:
            with suppress(zenoh.ZError):
                self._session.close()
            self._session = None

    def _take(self, sample: Any) -> None:
        attached = b"" if sample.attachment is None else sample.attachment.to_bytes()
        self._hear(str(sample.key_expr), sample.payload.to_bytes(), graph.publisher_of(attached))


class _Speaker:
    """A sender on one key, which numbers its messages."""

    def __init__(self, end: Any) -> None:
        self._end, self._identity, self._numbers = end, os.urandom(16), itertools.count(1)

    @property
    def is_heard(self) -> bool:
        """Return whether anybody receives its messages."""
        return bool(self._end.matching_status.matching)

    def _attachment(self) -> bytes:
        return graph.attachment(next(self._numbers), time.time_ns(), self._identity)


class Publisher(_Speaker):
    """A publisher of one topic."""

    def put(self, payload: bytes) -> None:
        """Publish a message."""
        self._end.put(payload, attachment=self._attachment())


class Caller(_Speaker):
    """A client of one service, which does not wait."""

    def __init__(self, end: Any, answered: Callable[[bytes], None]) -> None:
        super().__init__(end)
        self._answered = answered

    def put(self, payload: bytes) -> None:
        """Send a request."""
        self._end.get(self._take, payload=payload, attachment=self._attachment())

    def _take(self, reply: Any) -> None:
        if reply.ok is not None:
            self._answered(reply.ok.payload.to_bytes())

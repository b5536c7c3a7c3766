"""The bus over Zenoh: one router listens, every other process is a client of it (a star).

The only module that imports zenoh and the only place where its configuration is built. A run uses TLS with a
certificate at both ends and an access list at the router; without an identity everything is plain, for tests and
benches of other things.
"""

import json
import logging
import os
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import zenoh

from groundstation.bus import keys
from groundstation.bus.access import AccessList, access_control
from groundstation.bus.api import Sample, Subscription
from groundstation.bus.roles import Identity
from groundstation.bus.sender import Sender
from groundstation.bus.topics import Quality, Topic
from groundstation.errors import GroundStationError

_log = logging.getLogger(__name__)

# Setpoints go out at once, each in a batch of its own (express; docs/reference/zenoh.md 3).
# Sensor samples share a batch with others that wait: an idle link sends them as soon. After a stall of the router a
# batch takes all of them; single batches run out at 16, and the recorder then lost samples that the tracker had got.
_PRIORITY = {
    Quality.CONTROL: ("REAL_TIME", True),
    Quality.SENSOR: ("DATA_HIGH", False),
    Quality.STATE: ("DATA", False),
    Quality.BULK: ("DATA_LOW", False),
}
# Batches that wait for a link before further ones are dropped; 2 by default, 16 at most. A replay needs
# every message that the tracker got. A tick's setpoints are as many batches as drones fly, put back to back.
_QUEUED_BATCHES = {"real_time": 16, "data_high": 16, "data": 16, "data_low": 16}


AUTHORITY, CERTIFICATE, KEY = "authority.pem", ".pem", ".key"
REFUSED_BY = "zenoh_link_tls"
# The crate that reports refused connections; it reports denials of the access list only together with all permissions.
_LOGGED = f"error,{REFUSED_BY}=warn"
_DENIED_BY = "zenoh::net::routing::interceptor::access_control"
ALL: Mapping[str, float] = MappingProxyType({})


def _configuration(mode: str, endpoint: str, also: tuple[str, ...] = ()) -> dict[str, Any]:
    listens = mode == "router"
    return {
        "mode": mode,
        "listen": {"endpoints": [endpoint, *also] if listens else [], "exit_on_failure": True},
        "connect": {
            "endpoints": [] if listens else [endpoint],
            "timeout_ms": 500,
            "exit_on_failure": True,
            "retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2},
        },
        "scouting": {"delay": 0, "multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {
            "link": {
                "tx": {
                    "lease": 2000,
                    "keep_alive": 4,
                    "queue": {
                        "size": _QUEUED_BATCHES,
                        "congestion_control": {"block": {"wait_before_close": 200000}},
                    },
                }
            },
            "shared_memory": {"enabled": False},
        },
    }


def _secured(configuration: dict[str, Any], identity: Identity, end: str) -> dict[str, Any]:
    """Add the certificate of one end of a link ("listen" or "connect") to a configuration; refuse links without TLS."""
    folder = Path(identity.folder)
    configuration["transport"]["link"] |= {
        "protocols": ["tls"],
        "tls": {
            "root_ca_certificate": str(folder / AUTHORITY),
            f"{end}_certificate": str(folder / f"{identity.name}{CERTIFICATE}"),
            f"{end}_private_key": str(folder / f"{identity.name}{KEY}"),
            "enable_mtls": True,
            "verify_name_on_connect": True,
        },
    }
    return configuration


def _require_certificate(identity: Identity) -> None:
    """Raise GroundStationError if a run's certificates are gone, as after the last logout of a user without linger."""
    path = Path(identity.folder) / f"{identity.name}{CERTIFICATE}"
    if not path.is_file():
        remedy = "land, and start the run again (loginctl enable-linger keeps the folder after a logout)"
        raise GroundStationError(f"the certificate {path} of this run is gone: {remedy}")


def _thinned(at_most_hz: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return a rule for each key: those of one rule would share its rate."""
    return [
        {"id": key, "flows": ["ingress"], "messages": ["put"], "rules": [{"key_expr": key, "freq": rate_hz}]}
        for key, rate_hz in at_most_hz.items()
    ]


def _opened(configuration: dict[str, Any]) -> Any:
    return zenoh.open(zenoh.Config.from_json5(json.dumps(configuration)))


def open_router(
    endpoint: str,
    identity: Identity | None = None,
    access: AccessList | None = None,
    also: tuple[str, ...] = (),
    *,
    trace: bool = False,
) -> Any:
    """Return a listening router session, guarded if there are an identity and an access list.

    also: further endpoints that it listens on. A guarded one writes a line with REFUSED_BY to standard output for each
    stranger, and with `trace` one for each message that the access list lets pass or denies. Raises GroundStationError
    when the port is taken.
    """
    configuration = _configuration("router", endpoint, also)
    if identity is not None and access is not None:
        zenoh.init_log_from_env_or(f"{_LOGGED},{_DENIED_BY}=trace" if trace else _LOGGED)
        configuration = _secured(configuration, identity, "listen") | {"access_control": access_control(access)}
    try:
        return _opened(configuration)
    except zenoh.ZError as error:
        places = " and ".join((endpoint, *also))
        raise GroundStationError(f"cannot listen on {places}: is another run using this port? ({error})") from error


class ZenohBus(Sender):
    """A client of the router. Callbacks only enqueue; publishers are declared once per key."""

    def __init__(self, session: Any, site: str, source: str, run: str = "") -> None:
        super().__init__(site, source, run)
        self._session = session
        self._publishers: dict[str, Any] = {}
        self._subscribers: list[Any] = []

    def put(self, topic: Topic, entity: str, payload: bytes, attachment: bytes) -> None:
        """Hand bytes to Zenoh, with DROP: a blocking put can hang for seconds (docs/reference/zenoh.md 3)."""
        key = self.key(topic, entity)
        publisher = self._publishers.get(key) or self._declare(key, topic)
        try:
            publisher.put(payload, attachment=attachment or None)
        except zenoh.ZError as error:
            _log.debug("put on %s failed: %s", key, error)

    def _declare(self, key: str, topic: Topic) -> Any:
        priority, express = _PRIORITY[topic.quality]
        publisher = self._session.declare_publisher(
            key,
            encoding=topic.encoding,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=getattr(zenoh.Priority, priority),
            express=express,
        )
        self._publishers[key] = publisher
        return publisher

    def subscribe(
        self, topics: Iterable[Topic], entity: str = "*", source: str = "*", capacity: int = 4096, newest: bool = False
    ) -> Subscription:
        """Return one queue fed by all given topics of the given entity and source."""
        subscription = Subscription(capacity, newest)
        for topic in topics:
            expression = keys.expression(self.site, topic, entity, source)
            self._subscribers.append(self._session.declare_subscriber(expression, _enqueue_into(subscription)))
        return subscription

    def close(self) -> None:
        """Undeclare and close; an open session keeps the interpreter from exiting (docs/reference/zenoh.md 8)."""
        for subscriber in self._subscribers:
            subscriber.undeclare()
        self._subscribers.clear()
        self._session.close()


def _enqueue_into(subscription: Subscription) -> Callable[[Any], None]:
    def enqueue(sample: Any) -> None:
        arrived_ns, attachment = time.monotonic_ns(), sample.attachment
        annex = attachment.to_bytes() if attachment else b""
        subscription.offer(Sample(str(sample.key_expr), sample.payload.to_bytes(), annex, arrived_ns))

    return enqueue


def speak_on_one_thread() -> None:
    """Let the sessions of this process send and receive where they wait for their sockets; call it before one opens.

    A message then wakes one thread instead of three, at less throughput (docs/reference/zenoh.md 4).
    """
    os.environ.setdefault("ZENOH_RUNTIME", "(rx: (handover: app), tx: (handover: app), acc: (handover: app))")


def open_bus(
    endpoint: str,
    site: str,
    source: str,
    timeout_s: float = 10.0,
    identity: Identity | None = None,
    at_most_hz: Mapping[str, float] = ALL,
) -> ZenohBus:
    """Connect to the router, retrying until the time-out; raises GroundStationError naming the endpoint.

    identity: required by a guarded router; at_most_hz: by key, how many samples a second are let in.
    """
    configuration = _configuration("client", endpoint) | {"downsampling": _thinned(at_most_hz)}
    if identity is not None:
        _require_certificate(identity)
        configuration = _secured(configuration, identity, "connect")
    deadline = time.monotonic() + timeout_s
    while True:
        try:
            return ZenohBus(_opened(configuration), site, source, identity.run if identity else "")
        except zenoh.ZError as error:
            if time.monotonic() > deadline:
                raise GroundStationError(f"no router answers at {endpoint}: is the ground station running?") from error
            time.sleep(0.05)

"""The router process: listens and forwards, and does nothing else that could stall the team's messages."""

import time
from typing import Any

import msgspec

from groundstation.bus.access import AccessList
from groundstation.bus.messages import Event, Severity
from groundstation.bus.topics import EVENT
from groundstation.bus.zenoh_bus import ZenohBus, open_router
from groundstation.process.child import Child
from groundstation.process.priority import go_first
from groundstation.runtime.router_refusals import RouterRefusals
from groundstation.time_units import NS_PER_MS, NS_PER_S

_TURN_NS = 50 * NS_PER_MS
# Longer than sim_bridge and drivers take to land without a supervisor; their messages must still arrive.
_LINGER_NS = 25 * NS_PER_S


class RouterSection(msgspec.Struct, frozen=True):
    """The router's section: its endpoint, and the admitted members (None: all).

    also: further endpoints, for other hosts. name_refusals: whether events name members that publish without the right
    to.
    """

    endpoint: str
    access: AccessList | None = None
    also: tuple[str, ...] = ()
    name_refusals: bool = True


def run(child: Child) -> int:
    """Route until a stop is requested. When the supervisor dies, stay until the landing has had its time."""
    section = msgspec.json.decode(child.section, type=RouterSection)
    refusals = RouterRefusals()
    session = open_router(
        section.endpoint, child.spec.identity, section.access, section.also, trace=section.name_refusals
    )
    bus = ZenohBus(session, child.spec.site, child.name)
    child.ready()
    go_first()  # for this loop alone, which beats: on an overloaded processor a living router once counted as hung
    orphaned_ns = 0
    while not child.stop_requested:
        now_ns = time.monotonic_ns()
        if not child.supervisor_alive:
            orphaned_ns = orphaned_ns or now_ns
            if now_ns - orphaned_ns > _LINGER_NS or not _has_clients(session):
                break
        for text in refusals.take(now_ns):
            bus.publish(EVENT, Event(header=bus.header(child.name), severity=Severity.WARNING, text=text))
        child.beat()
        child.sleep_until(now_ns + _TURN_NS)
    bus.close()
    refusals.close()
    return 0


def _has_clients(session: Any) -> bool:
    return bool(session.info.transports())

"""What the supervisor says of processes that cannot speak for themselves."""

from types import SimpleNamespace
from typing import Any

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Lifecycle, ProcessStatus
from groundstation.bus.topics import PROCESS_STATUS
from groundstation.supervisor.status import StatusPublisher


def test_who_was_not_started_yet_has_not_ended() -> None:
    exchange = MemoryExchange()
    heard = MemoryBus(exchange, "lab", "console").subscribe([PROCESS_STATUS])
    table: list[Any] = [
        SimpleNamespace(
            spec=SimpleNamespace(name=name, on_bus=True), pid=0, running=False, life=life, restart_due_ns=due
        )
        for name, life, due in (("tracker", 0, None), ("recorder", 1, None), ("console", 2, 5))
    ]
    StatusPublisher(MemoryBus(exchange, "lab", "supervisor")).publish_due(10**9, table)
    told = [received.message for received in heard.drain()]
    words = {one.header.entity: (one.state, one.detail) for one in told if isinstance(one, ProcessStatus)}
    assert words == {
        "supervisor": (Lifecycle.READY, ""),
        "recorder": (Lifecycle.STOPPING, "ended"),
        "console": (Lifecycle.STOPPING, "restarting"),
    }

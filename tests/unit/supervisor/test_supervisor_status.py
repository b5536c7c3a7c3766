"""The supervisor's reports about processes that cannot report themselves."""

from types import SimpleNamespace
from typing import Any

import pytest

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Lifecycle, ProcessStatus
from groundstation.bus.topics import PROCESS_STATUS
from groundstation.supervisor import status
from groundstation.supervisor.status import StatusPublisher


def test_a_process_not_yet_started_is_not_reported_as_ended() -> None:
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


def test_processor_use_beyond_the_run_is_attributed_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    exchange = MemoryExchange()
    heard = MemoryBus(exchange, "lab", "console").subscribe([PROCESS_STATUS])
    publisher = StatusPublisher(MemoryBus(exchange, "lab", "supervisor"))
    tracker: Any = SimpleNamespace(spec=SimpleNamespace(name="tracker", on_bus=True), pid=7, running=True, life=1)
    for second, computer_s, tracker_s in ((1, 100.0, 20.0), (2, 101.9, 20.4), (3, 102.3, 20.8)):
        monkeypatch.setattr(status, "busy_s", lambda value=computer_s: value)
        monkeypatch.setattr(status, "_used_s", lambda pid, value=tracker_s: value)
        monkeypatch.setattr(publisher._use, "since", lambda: (0.1, 0.0))
        publisher.publish_due(second * 10**9, [tracker])
    told = [received.message for received in heard.drain()]
    others = [one.others_cpu for one in told if isinstance(one, ProcessStatus)]
    assert others[1:] == pytest.approx([1.4, 0.0])

"""Publishes the supervisor's status, and that of processes that cannot publish their own."""

import os
from collections.abc import Iterable
from typing import Any

from groundstation.bus.api import Bus
from groundstation.bus.messages import Lifecycle, ProcessStatus
from groundstation.bus.topics import PROCESS_STATUS
from groundstation.process.heartbeat import SlotState
from groundstation.process.processor import OwnUse, busy_s
from groundstation.process.stat_file import stat_of
from groundstation.supervisor.managed_process import ManagedProcess
from groundstation.time_units import NS_PER_S

_PERIOD_NS = NS_PER_S
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_COMPUTER = 0  # no process has this number


class StatusPublisher:
    """Publishes once a second: the supervisor, the router (nothing else runs in it), and dead processes."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._next_ns = 0
        self._cpu_marks: dict[int, tuple[int, float]] = {}
        self._use = OwnUse()

    def publish_due(self, now_ns: int, processes: Iterable[ManagedProcess]) -> None:
        """Publish due statuses."""
        if now_ns < self._next_ns:
            return
        self._next_ns = now_ns + _PERIOD_NS
        started = [process for process in processes if process.life]  # others are not due to start yet: nothing ended
        shares = {one.pid: self._share_since(one.pid, now_ns, _used_s(one.pid)) for one in started if one.running}
        cpu, waited = self._use.since()
        others = self._others(now_ns, cpu + sum(shares.values()))
        self._publish(self._bus.source, Lifecycle.READY, os.getpid(), cpu, waited=waited, others_cpu=others)
        for process in started:
            name, pid = process.spec.name, process.pid
            if not process.running:
                text = "restarting" if process.restart_due_ns is not None else "ended"
                self._publish(name, Lifecycle.STOPPING, pid, 0.0, detail=text)
            elif not process.spec.on_bus and process.state is not SlotState.EMPTY:
                self._publish(name, Lifecycle[process.state.name], pid, shares[pid])

    def _publish(self, name: str, state: Lifecycle, pid: int, cpu: float, **more: Any) -> None:
        header = self._bus.header(name)
        self._bus.publish(PROCESS_STATUS, ProcessStatus(header=header, state=state, pid=pid, cpu=cpu, **more))

    def _others(self, now_ns: int, ours: float) -> float | None:
        """Return how many cores other programs used; ours: what this run used. Both ignore grandchildren."""
        busy = busy_s()
        return None if busy is None else max(0.0, self._share_since(_COMPUTER, now_ns, busy) - ours)

    def _share_since(self, key: int, now_ns: int, cpu_s: float) -> float:
        before_ns, before_s = self._cpu_marks.get(key, (0, cpu_s))
        self._cpu_marks[key] = (now_ns, cpu_s)
        return max(0.0, cpu_s - before_s) / max(1e-9, (now_ns - before_ns) / 1e9)


def _used_s(pid: int) -> float:
    fields = stat_of(pid)
    return 0.0 if fields is None else (int(fields[11]) + int(fields[12])) / _TICKS_PER_S

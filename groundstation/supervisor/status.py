"""Publishes the supervisor's status, and that of processes that cannot publish their own."""

import os
import time
from collections.abc import Iterable

from groundstation.bus.api import Bus
from groundstation.bus.messages import Lifecycle, ProcessStatus
from groundstation.bus.topics import PROCESS_STATUS
from groundstation.process.heartbeat import SlotState
from groundstation.process.stat_file import stat_of
from groundstation.supervisor.managed_process import ManagedProcess
from groundstation.time_units import NS_PER_S

_PERIOD_NS = NS_PER_S
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")


class StatusPublisher:
    """Publishes once a second: the supervisor, the router (nothing else runs in it), and whoever is down."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._next_ns = 0
        self._cpu_marks: dict[int, tuple[int, float]] = {}

    def publish_due(self, now_ns: int, processes: Iterable[ManagedProcess]) -> None:
        """Publish due statuses."""
        if now_ns < self._next_ns:
            return
        self._next_ns = now_ns + _PERIOD_NS
        self._publish(self._bus.source, Lifecycle.READY, os.getpid(), self._own_share(now_ns), "")
        for process in processes:
            name, pid = process.spec.name, process.pid
            if process.life == 0:
                continue  # it is not due to start yet: nothing ended
            if not process.running:
                text = "restarting" if process.restart_due_ns is not None else "ended"
                self._publish(name, Lifecycle.STOPPING, pid, 0.0, text)
            elif not process.spec.on_bus and process.state is not SlotState.EMPTY:
                self._publish(name, Lifecycle[process.state.name], pid, self._share(pid, now_ns), "")

    def _publish(self, name: str, state: Lifecycle, pid: int, cpu: float, detail: str) -> None:
        header = self._bus.header(name)
        self._bus.publish(PROCESS_STATUS, ProcessStatus(header=header, state=state, pid=pid, cpu=cpu, detail=detail))

    def _own_share(self, now_ns: int) -> float:
        return self._share_since(0, now_ns, time.process_time())

    def _share(self, pid: int, now_ns: int) -> float:
        fields = stat_of(pid)
        if fields is None:
            return 0.0
        return self._share_since(pid, now_ns, (int(fields[11]) + int(fields[12])) / _TICKS_PER_S)

    def _share_since(self, key: int, now_ns: int, cpu_s: float) -> float:
        before_ns, before_s = self._cpu_marks.get(key, (0, cpu_s))
        self._cpu_marks[key] = (now_ns, cpu_s)
        return max(0.0, cpu_s - before_s) / max(1e-9, (now_ns - before_ns) / 1e9)

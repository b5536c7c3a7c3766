"""The start of a run: guardian and router, then required processes, then the devices."""

import time

from groundstation.bus.messages import Severity
from groundstation.errors import GroundStationError
from groundstation.supervisor import kernels
from groundstation.supervisor.managed_process import ManagedProcess
from groundstation.supervisor.process_spec import StopOrder
from groundstation.supervisor.supervisor import Supervisor
from groundstation.supervisor.waiting import Waiting

_OPTIONAL_GRACE_S = 5.0


class Interrupted(GroundStationError):
    """Raised when the operator asked to stop during the start."""


class Start:
    """Starts the processes that a supervisor then watches.

    `Supervisor.close` stops them, even if the start did not finish.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor

    def run(self) -> None:
        """Compile missing kernels, start one rank after the other; returns when the run can begin.

        Devices come last: emulated ones answer once the simulator is up, and would be reported as silent before.

        Raises GroundStationError when a required process cannot be started, fails or is late, Interrupted when the
        operator stops it.
        """
        supervisor = self._supervisor
        supervisor.prepare()
        self._compile()
        first = [p for p in supervisor.processes if p.spec.stop_order >= StopOrder.CONNECTS]
        self._launch_all(first)
        self._wait_for(first)
        supervisor.connect()
        others = [p for p in supervisor.processes if p not in first and not p.spec.on_terminal]
        required = [p for p in others if p.spec.required]
        self._launch_all(required)
        supervisor.write_runtime_file()
        self._wait_for(required)
        optional = [p for p in others if not p.spec.required]
        self._launch_all(optional)
        supervisor.write_runtime_file()
        self._wait_for([p for p in optional if p.spec.awaited], _OPTIONAL_GRACE_S)

    def show_screen(self) -> None:
        """Hand the terminal to the process that draws on it, if the table has one; once."""
        for process in self._supervisor.processes:
            if process.spec.on_terminal and not process.life:
                self._supervisor.terminal.muted = True
                self._supervisor.launch(process)

    def _compile(self) -> None:
        supervisor = self._supervisor
        needed = any(process.spec.kernels for process in supervisor.processes)
        if not needed or kernels.are_compiled():
            return
        if not kernels.compile_first(supervisor.terminal.say, self._stop_wished):
            raise Interrupted("stopped while starting")

    def _stop_wished(self) -> bool:
        """Return whether the operator asked to stop, and answer other keys meanwhile."""
        self._supervisor.events.told(self._supervisor.interrupts.clear())
        return self._supervisor.interrupts.stop_requested

    def _launch_all(self, processes: list[ManagedProcess]) -> None:
        for process in processes:
            self._supervisor.launch(process)
            self._raise_failure()

    def _wait_for(self, processes: list[ManagedProcess], grace_s: float | None = None) -> None:
        """Wait until all are up or out of time; continue without processes that have only a grace period."""
        supervisor = self._supervisor
        waiting = Waiting(processes, time.monotonic(), grace_s)
        while waiting.processes:
            supervisor.step()
            now_s = time.monotonic()
            for process in waiting.take_up():
                supervisor.events.state(process)
            self._raise_failure()
            if supervisor.interrupts.stop_requested:
                raise Interrupted("stopped while starting")
            for process in waiting.take_late(now_s):
                self._late(process)
            self._raise_failure()
            if note := waiting.note(now_s):
                supervisor.terminal.say(f"  waiting for {note}")

    def _late(self, process: ManagedProcess) -> None:
        events = self._supervisor.events
        if process.spec.required:
            self._supervisor.fail(process, f"is not ready {process.spec.start_limit_s:.0f} s after the start")
        elif process.is_up:
            events.state(process)
        else:
            events.event(Severity.WARNING, process, "is not ready; going on without it", "see its log")

    def _raise_failure(self) -> None:
        if self._supervisor.failure:
            raise GroundStationError(self._supervisor.failure)

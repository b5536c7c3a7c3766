"""Events of processes, for the operator's terminal, the log and the bus."""

import logging

from groundstation.bus.api import Bus
from groundstation.bus.messages import RUN, Event, Severity
from groundstation.bus.topics import EVENT
from groundstation.process.heartbeat import SlotState
from groundstation.supervisor.managed_process import ManagedProcess
from groundstation.supervisor.terminal import Terminal

_log = logging.getLogger(__name__)


class ProcessEvents:
    """Reports states and events of processes; bus: None before the router is up and after the run."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal
        self.bus: Bus | None = None
        self._degraded: set[ManagedProcess] = set()

    def state(self, process: ManagedProcess) -> None:
        """Show the operator the state of a process that is up."""
        (self._degraded.discard if process.state is SlotState.READY else self._degraded.add)(process)
        self._terminal.say(f"  {process.spec.name:<12} {process.state.name.lower()}  {process.detail}".rstrip())

    def recovery(self, process: ManagedProcess) -> None:
        """Show that a process is ready again, if it was last shown as degraded."""
        if process in self._degraded:
            self.state(process)

    def event(self, severity: Severity, process: ManagedProcess, text: str, remedy: str = "") -> None:
        """Log and publish an event of a process; all but INFO is shown to the operator."""
        _log.warning("%s %s %s", severity, process.spec.name, text)
        if severity is not Severity.INFO:
            self._terminal.say(f"  {process.spec.name}: {text}")
        if self.bus is not None:
            header = self.bus.header(process.spec.name)
            self.bus.publish(EVENT, Event(header=header, severity=severity, text=text, remedy=remedy))

    def told(self, text: str) -> None:
        """Report something about the run to the operator, here and in the events of its pages; "": nothing."""
        if not text:
            return
        self._terminal.say(text)
        if self.bus is not None:
            self.bus.publish(EVENT, Event(header=self.bus.header(RUN), severity=Severity.INFO, text=text))

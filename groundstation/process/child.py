"""The means of a child process: its bus, heartbeat, lifecycle, and requests to stop."""

import logging
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import Event, Lifecycle, ProcessStatus, Severity
from groundstation.bus.roles import Identity
from groundstation.bus.topics import EVENT, PROCESS_STATUS
from groundstation.errors import GroundStationError, without_passwords
from groundstation.process import log
from groundstation.process.heartbeat import SUPERVISOR_SLOT, HeartbeatBlock, SlotState
from groundstation.process.parent import ParentWatch
from groundstation.process.priority import take_share
from groundstation.process.processor import OwnUse
from groundstation.process.signals import StopSignal
from groundstation.time_units import NS_PER_MS, NS_PER_S

_STATUS_PERIOD_NS = NS_PER_S
_SUPERVISOR_STALE_NS = 300 * NS_PER_MS
ENDS_BY = f"{__name__}: ends by "
"""What precedes the reason of a child's end in its log."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ChildSpec:
    """Settings of a child, read at its start.

    name: its source name on the bus; endpoint: the router ("" = no bus); heartbeat: path of the block ("" = none), with
    the child's slot in it; section: its settings as JSON; parent_pid: pid of its starter (0 = any); identity: its
    certificate for the router, or the router's for others (None: not needed); clock: id of the run's clock if that is
    another host's ("": this host's own); nice: below 0 for a larger share of the processor (docs/decisions/0137);
    spoken_since_ns: since when others have sent in its place (0: nobody does); at_most_hz: by key, largest rate of
    samples that its bus accepts. A process that thins only displays, and is woken as seldom as possible
    (docs/decisions/0169).
    """

    name: str
    role: str
    endpoint: str
    site: str
    heartbeat: str = ""
    heartbeat_index: int = 0
    section: str = "{}"
    parent_pid: int = 0
    identity: Identity | None = None
    clock: str = ""
    nice: int = 0
    spoken_since_ns: int = 0
    at_most_hz: Mapping[str, float] = field(default_factory=dict)


class Child:
    """Context manager around the life of one child process; use it in the main thread.

    Inside the block, `bus` is connected, SIGINT is ignored, and SIGTERM or SIGHUP set `stop_requested`.
    Call `beat` and `tick_status` at least 10 times a second once `ready` was called.
    """

    bus: Bus

    def __init__(self, spec: ChildSpec) -> None:
        self.spec = spec
        self.name = spec.name
        self.section = spec.section
        self._block: HeartbeatBlock | None = None
        self._finished = False
        self._state = Lifecycle.STARTING
        self._detail = ""
        self._counters = (0, 0, 0)
        self._next_status_ns = 0
        self._use = OwnUse()
        self._addresses: tuple[tuple[str, int], ...] = ()

    def __enter__(self) -> Self:
        with suppress(PermissionError):  # already the leader of a group
            os.setsid()  # keeps the terminal's Ctrl-C and hang-up away from processes that must land first
        log.configure(self.name)
        take_share(self.spec.nice)  # not its parent's; before its bus threads begin, and before heavy imports
        self._parent = ParentWatch(self.spec.parent_pid)
        self._stop = StopSignal(self._parent)
        self._stop.install()
        if self.spec.heartbeat:
            self._block = self._attached_block()
            if self.spec.clock:
                clock.follow(self.spec.clock, self._block.clock_offset_ns)
        self._set_state(Lifecycle.STARTING, "")
        if self.spec.endpoint:
            self.bus = self._opened_bus()
            self.publish_status()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._finished and self._block is not None:
            self._block.end(self.spec.heartbeat_index)  # not before: one that hangs while it closes its links is killed
        known = error is None or isinstance(error, GroundStationError)
        self._set_state(
            Lifecycle.STOPPING, str(error or "") if known else without_passwords(f"{type(error).__name__}: {error}")
        )
        if error is not None:
            _log.error("ends by %s: %s", kind.__name__ if kind else "?", error)
        if self._has_bus:
            self.publish_status()
            self.bus.close()
        self._stop.close()
        self._parent.close()
        if self._block is not None:
            if self.spec.clock:
                last_ns = self._block.clock_offset_ns()
                clock.follow(self.spec.clock, lambda: last_ns)  # threads of a driver may still read the clock
            self._block.close()
            self._block = None

    def _attached_block(self) -> HeartbeatBlock:
        try:
            return HeartbeatBlock.attach(self.spec.heartbeat)
        except (OSError, ValueError) as error:  # without a file, or an empty one
            why = error.strerror if isinstance(error, OSError) else error
            text = f"cannot beat in {self.spec.heartbeat}: {why}; land, end the run and start it again"
            raise GroundStationError(text) from error

    def _opened_bus(self) -> Bus:
        from groundstation.bus.zenoh_bus import open_bus, speak_on_one_thread

        spec = self.spec
        if spec.at_most_hz:
            speak_on_one_thread()
        return open_bus(spec.endpoint, spec.site, self.name, identity=spec.identity, at_most_hz=spec.at_most_hz)

    @property
    def _has_bus(self) -> bool:
        return bool(self.spec.endpoint) and hasattr(self, "bus")

    @property
    def stop_requested(self) -> bool:
        """Return whether SIGTERM or SIGHUP came: a driver lands and exits, others finish and exit."""
        return self._stop.requested

    @property
    def supervisor_alive(self) -> bool:
        """Return whether the supervisor lives; once False: a driver hovers, lands and exits, others exit."""
        return self._parent.alive

    @property
    def supervisor_fresh(self) -> bool:
        """Return whether the supervisor's own heartbeat is younger than 0.3 s (False while it is frozen)."""
        if self._block is None:
            return True
        return self._block.age_ns(SUPERVISOR_SLOT, time.monotonic_ns()) < _SUPERVISOR_STALE_NS

    @property
    def run_ends(self) -> bool:
        """Return whether the supervisor stops the processes of the run, so that no order reaches a drone any more."""
        return self._block is not None and self._block.state(SUPERVISOR_SLOT) is SlotState.STOPPING

    @property
    def spoken_for_ns(self) -> int:
        """Return how long others have been sending in this process's place [ns]; 0: nobody does."""
        since_ns = self.spec.spoken_since_ns
        return time.monotonic_ns() - since_ns if since_ns else 0

    def wake(self) -> None:
        """End a sleep early, the one under way or the next; from any thread."""
        self._stop.wake()

    def sleep_until(self, deadline_ns: int) -> bool:
        """Sleep until a time or `wake`; False when a stop, or the supervisor's death, ended it (each once)."""
        return self._stop.sleep_until(deadline_ns)

    def turns(self, period_ns: int) -> Iterator[int]:
        """Yield the numbers of the turns of a loop, from 1 on, with a heartbeat after each, until it is to end."""
        count, due_ns = 0, clock.now_ns()
        while not self.stop_requested and self.supervisor_alive:
            count += 1
            yield count
            self.beat()
            due_ns = max(due_ns + period_ns, clock.now_ns())
            self.sleep_until(due_ns)

    def beat(self) -> None:
        """Signal that the main loop turns; takes about a microsecond."""
        if self._block is not None:
            self._block.beat(self.spec.heartbeat_index)

    def note_addresses(self, addresses: Sequence[tuple[str, int]]) -> None:
        """Record the last addresses of vehicles that call us, for a process that sends to them after this one."""
        if self._block is not None and tuple(addresses) != self._addresses:
            self._addresses = tuple(addresses)
            self._block.set_addresses(self.spec.heartbeat_index, self._addresses)

    def finish(self) -> None:
        """Record that no vehicle of this driver needs anybody; whoever ends without it is spoken for as if it died."""
        self._finished = True

    def leave(self, number: int) -> None:
        """Record a number (0 to 2^62) for the process that is started in place of this one."""
        if self._block is not None:
            self._block.leave(self.spec.heartbeat_index, number)

    @property
    def left(self) -> int:
        """Return the number that the process before this one recorded, 0 for none."""
        return 0 if self._block is None else self._block.left(self.spec.heartbeat_index)

    def starting(self, detail: str) -> None:
        """Report the reason for which the start waits; shown to the operator."""
        self._announce(Lifecycle.STARTING, detail)

    def ready(self, detail: str = "") -> None:
        """Declare the start finished: from now on the hang limit counts."""
        self._announce(Lifecycle.READY, detail)

    def degrade(self, detail: str, works: bool = True) -> None:
        """Declare that the process runs but lacks something; `ready` ends it.

        works: False for a driver that has not heard its vehicle yet: whoever sends to it meanwhile goes on.
        """
        self._announce(Lifecycle.DEGRADED, detail, works)

    def tick_status(self, ticks: int = 0, overruns: int = 0, overflowed: int = 0) -> None:
        """Remember the loop's counters and publish the status once a second; call it each turn."""
        self._counters = (ticks, overruns, overflowed)
        if time.monotonic_ns() >= self._next_status_ns:
            self.publish_status()

    def publish_status(self) -> None:
        """Publish the ProcessStatus now."""
        if not self._has_bus:
            return
        cpu, waited = self._use.since()
        self._next_status_ns = time.monotonic_ns() + _STATUS_PERIOD_NS
        ticks, overruns, overflowed = self._counters
        status = ProcessStatus(
            header=self.bus.header(self.name),
            state=self._state,
            pid=os.getpid(),
            cpu=cpu,
            waited=waited,
            ticks=ticks,
            overruns=overruns,
            overflowed=overflowed,
            detail=self._detail,
        )
        self.bus.publish(PROCESS_STATUS, status)

    def event(
        self,
        severity: Severity | str,
        text: str,
        remedy: str = "",
        entity: str | None = None,
        *,
        injected: bool = False,
    ) -> None:
        """Publish and log something that happened, about this process unless an entity is named."""
        level = {Severity.INFO: logging.INFO, Severity.WARNING: logging.WARNING, Severity.ERROR: logging.ERROR}
        severity = Severity(severity)
        _log.log(level[severity], "%s%s", text, f" ({remedy})" if remedy else "")
        if self._has_bus:
            header = self.bus.header(entity or self.name)
            event = Event(header=header, severity=severity, text=text, remedy=remedy, injected=injected)
            self.bus.publish(EVENT, event)

    def _announce(self, state: Lifecycle, detail: str, works: bool = True) -> None:
        if (state, detail) == (self._state, self._detail):
            return
        if detail and detail != self._detail:
            _log.info("%s: %s", state, detail)
        self._set_state(state, detail, works)
        self.publish_status()

    def _set_state(self, state: Lifecycle, detail: str, works: bool = True) -> None:
        self._state, self._detail = state, detail
        if self._block is not None:
            self._block.set_state(self.spec.heartbeat_index, SlotState[state.name], works)

"""Watches the processes of a run, restarts dead and hanging ones, and stops them in order."""

import logging
import os
import select
import shutil
import signal
import time
from collections.abc import Callable
from functools import partial

from groundstation.bus.api import Subscription
from groundstation.bus.messages import Lifecycle, ProcessStatus, Severity
from groundstation.bus.roles import SHELLS, Identity
from groundstation.bus.thinning import rates_by_key
from groundstation.bus.topics import ODOMETRY, PROCESS_STATUS
from groundstation.bus.zenoh_bus import ZenohBus, open_bus
from groundstation.process import ports
from groundstation.process.heartbeat import SUPERVISOR_SLOT, HeartbeatBlock, SlotState
from groundstation.process.priority import go_back, go_first, take_share
from groundstation.supervisor import runtime_file
from groundstation.supervisor.events import ProcessEvents
from groundstation.supervisor.failsafe_sender import FailsafeSender, unreachable
from groundstation.supervisor.interrupts import Interrupts
from groundstation.supervisor.launcher import Launcher
from groundstation.supervisor.managed_process import ManagedProcess
from groundstation.supervisor.process_spec import ProcessSpec, Restart, StopOrder, slot_of
from groundstation.supervisor.run import SOURCE, Run
from groundstation.supervisor.run_entry import RunEntry
from groundstation.supervisor.status import StatusPublisher
from groundstation.supervisor.terminal import Terminal
from groundstation.time_units import NS_PER_MS, NS_PER_S

_TURN_S = 0.05
_OWN_DELAY_NS = 200 * NS_PER_MS
_HURRY_S = 1.0
_QUIET_S = 0.3  # processes beat ten times a second
_STARVED_FOR = 3.0  # times the limit of one that hangs
_HEIGHTS_HZ = 12.5  # of drones that take off or have landed
_TOLD_AGAIN_NS = 10 * NS_PER_S
# A process that remains after a kill hangs in the kernel, on a device or a network disk.
_KERNEL_S = 3.0
_log = logging.getLogger(__name__)


class Supervisor:
    """Owns all processes of a run, which `Start` starts.

    `step` must be called 10 times a second or more; it sleeps by itself. watched: called in each step to decide whether
    to beat; on another host it stands for the run's supervisor, and is silent when that is.
    """

    def __init__(
        self,
        run: Run,
        table: tuple[ProcessSpec, ...],
        terminal: Terminal,
        watched: Callable[["HeartbeatBlock"], bool] = lambda block: True,
    ) -> None:
        self.run = run
        self._watched = watched
        self.terminal = terminal
        self.events = ProcessEvents(terminal)
        self.interrupts = Interrupts()
        self._block = HeartbeatBlock.create(f"skein-{run.site}-{os.getpid()}", len(table) + 1)
        self._identities = runtime_file.identities_of(run.site, os.getpid()) if run.makes_identities else None
        self._launcher = Launcher(run, self._block.descriptor, self._identities)
        self.processes = [ManagedProcess(spec, slot_of(index), self._block) for index, spec in enumerate(table)]
        self._last_words = FailsafeSender()
        self.bus: ZenohBus | None = None
        self._statuses: Subscription | None = None
        self._publisher: StatusPublisher | None = None
        self.failure = ""
        self._entry = RunEntry(run, self._block.path, self._identities)
        self._turn_ns = self._awake_since_ns = time.monotonic_ns()
        self._tell_starved_ns = 0
        self._stopping = False

    # -- start ---------------------------------------------------------------------------------------------------

    def prepare(self) -> None:
        """Listen to the operator's signals and open the log files; raises GroundStationError when it cannot."""
        self.interrupts.install()
        self._launcher.prepare(tuple(process.spec for process in self.processes))
        self._find_words()
        self._make_identities()
        self._block.set_state(SUPERVISOR_SLOT, SlotState.READY)

    def _find_words(self) -> None:
        """Open the transports of failsafe datagrams; an unusable link makes its driver's start fail anyway."""
        for process in self.processes:
            words = process.spec.failsafe_datagrams
            if words is not None and (why := self._last_words.prepare(process.spec.name, words)):
                _log.error(unreachable(process.spec.name, why))

    def _make_identities(self) -> None:
        if self._identities is None:
            return
        from groundstation.supervisor.site import certify

        members = [process.spec.name for process in self.processes if process.spec.on_bus or process.spec.is_router]
        names = (*members, SOURCE, *(member.name for member in SHELLS))
        certify(self._identities, self.run.site, ports.host_of(self.run.endpoint), self.run.listen, names)

    def connect(self) -> None:
        """Join the bus, whose router is up, and take priority from now on: drones hover if this loop stops."""
        run = self.run
        take_share()  # for the threads of its bus
        heights = rates_by_key(run.site, ((ODOMETRY, run.drones, _HEIGHTS_HZ),))
        self.bus = open_bus(run.endpoint, run.site, run.source, identity=self._identity(), at_most_hz=heights)
        self.events.bus = self.bus
        self._statuses = self.bus.subscribe([PROCESS_STATUS], newest=True)
        self._publisher = StatusPublisher(self.bus)
        go_first()

    def _identity(self) -> Identity | None:
        own = Identity(str(self._identities), SOURCE, self.run.name) if self._identities else None
        return own or self.run.identity

    def launch(self, process: ManagedProcess) -> None:
        """Start a process; one that cannot be executed is retried, or fails the run if required."""
        try:
            spoken_since_ns = self._last_words.began_ns(process.spec.name)
            handle = self._launcher.launch(process.spec, process.slot, process.life, spoken_since_ns)
            process.adopt(handle, time.monotonic_ns())
        except OSError as error:
            why = f"cannot be started: {error.strerror}" + (f": {error.filename}" if error.filename else "")
            if process.spec.required and not process.life:
                self.failure = f"{process.spec.name} {why}"
            else:
                process.schedule_restart(time.monotonic_ns())
            self.events.event(Severity.ERROR, process, why)

    def write_runtime_file(self) -> None:
        """Write the runtime file, by which other commands find this run and its processes."""
        self._entry.write(self.processes)

    # -- watch ---------------------------------------------------------------------------------------------------

    def step(self, timeout_s: float = _TURN_S) -> None:
        """Sleep until an event or the time-out, then check every process once."""
        self._beat()
        self._sleep(timeout_s)
        self._beat()
        now_ns = time.monotonic_ns()
        if now_ns - self._turn_ns > _OWN_DELAY_NS + int(timeout_s * NS_PER_S):
            self._awake_since_ns = now_ns  # the supervisor was frozen itself: earlier silence of others does not count
        self._turn_ns = now_ns
        self._read_statuses()
        for process in self.processes:
            self._watch(process, now_ns)
        self._last_words.send_due(now_ns)
        if self._publisher is not None:
            self._publisher.publish_due(now_ns, self.processes)

    def _beat(self) -> None:
        if self._watched(self._block):
            self._block.beat(SUPERVISOR_SLOT)

    @property
    def unwell(self) -> list[str]:
        """Return the processes that were started and do not work (yet), except starting ones that are not awaited."""
        started = [p for p in self.processes if p.life and not p.spec.on_terminal and p.state is not SlotState.READY]
        return [p.spec.name for p in started if p.spec.awaited or not p.begins]

    def _sleep(self, timeout_s: float) -> None:
        poll = select.poll()
        poll.register(self.interrupts.descriptor, select.POLLIN)
        for process in self.processes:
            if process.running:
                poll.register(process.pidfd, select.POLLIN)
        ready = poll.poll(timeout_s * 1000)
        if any(descriptor == self.interrupts.descriptor for descriptor, _ in ready):
            self.events.told(self.interrupts.clear())

    def _read_statuses(self) -> None:
        if self._statuses is None:
            return
        details = {r.key.entity: r.message for r in self._statuses.drain() if r.key.source == r.key.entity}
        for process in self.processes:
            status = details.get(process.spec.name)
            if isinstance(status, ProcessStatus):
                process.heard(status)
                if status.state is Lifecycle.READY:
                    self.events.recovery(process)

    def _watch(self, process: ManagedProcess, now_ns: int) -> None:
        if not process.running:
            if process.restart_due_ns is not None and now_ns >= process.restart_due_ns and not self._stopping:
                self.launch(process)
                self._entry.update(self.processes)
            return
        code = process.reap()
        if code is not None:
            self._ended(process, code, now_ns)
        elif self._stopping:
            return  # the stop has its own deadlines
        elif process.is_up:
            self._watch_heartbeat(process, now_ns)
        elif process.state is SlotState.STOPPING:
            late = process.heartbeat_age_ns(now_ns) > process.spec.stop_limit_s * NS_PER_S
            self._kill(process, "hung while ending by itself", late)
        else:
            late = now_ns - process.started_ns > process.spec.start_limit_s * NS_PER_S
            self._kill(process, f"not ready {process.spec.start_limit_s:.0f} s after its start", late)

    def _watch_heartbeat(self, process: ManagedProcess, now_ns: int) -> None:
        process.ready_ns = process.ready_ns or now_ns
        # Silence counts only while this loop was awake, unless the guardian has noticed it meanwhile.
        heard_s = min(process.heartbeat_age_ns(now_ns), now_ns - self._awake_since_ns) / NS_PER_S
        if heard_s <= _QUIET_S:
            process.heard_again()
        starved = heard_s > _QUIET_S and process.starved(now_ns)
        limit_ns = int(process.spec.silence_limit_s * NS_PER_S)
        process.silent_since_ns = process.judge_silence(now_ns, self._awake_since_ns, limit_ns)
        if not process.silent_since_ns:
            if self._last_words.end(process.spec.name):
                self.events.event(Severity.INFO, process, "is back in control of its drone")
            return
        self._speak_for(process, f"silent for {heard_s:.2f} s")
        late_s = process.spec.hang_limit_s
        late = heard_s >= late_s
        # A new one would wait for a core as well. A driver must not come back and contradict its substitute.
        if late and starved and process.spec.failsafe_datagrams is None and heard_s < _STARVED_FOR * late_s:
            self._tell_starved(process, now_ns)
        else:
            self._kill(process, f"hung: no heartbeat for {heard_s:.2f} s{process.spec.suspect}", late)

    def _tell_starved(self, process: ManagedProcess, now_ns: int) -> None:
        if now_ns >= self._tell_starved_ns:
            self._tell_starved_ns = now_ns + _TOLD_AGAIN_NS
            text = "gets no core of the processor: this computer is too busy"
            self.events.event(Severity.ERROR, process, text, "close other programs on it, or land")

    def _speak_for(self, process: ManagedProcess, why: str) -> None:
        words = process.spec.failsafe_datagrams
        if words is None or self._stopping or not process.silent_since_ns:  # its work is done, or never began
            return
        known = partial(self._block.addresses, process.slot), partial(self._block.left, process.slot)
        if self._last_words.begin(process.spec.name, words, process.silent_since_ns, *known):
            self.events.event(Severity.WARNING, process, f"{why}: the supervisor tells its drone to hover")

    def _kill(self, process: ManagedProcess, reason: str, due: bool) -> None:
        if due and not process.kill_reason:
            process.kill_reason = reason
            process.signal_group(signal.SIGKILL)

    def _ended(self, process: ManagedProcess, code: int, now_ns: int) -> None:
        if self._stopping:
            return
        why = process.end_text(code, self._launcher.last_words)
        self._speak_for(process, why)
        never_up = not process.ready_ns and process.life == 1
        if process.spec.restart is Restart.ENDS_RUN or (never_up and process.spec.required):
            self.fail(process, why)
            return
        delay_s = process.schedule_restart(now_ns)
        process.ready_ns = 0
        severity = Severity.ERROR if process.storms else Severity.WARNING
        soon = f" in {delay_s:.1f} s" if delay_s else ""
        self.events.event(severity, process, f"{why}; restarting{soon}", "see its log")

    def fail(self, process: ManagedProcess, why: str) -> None:
        """End the run because a required process has failed."""
        name = process.spec.name
        self.failure = f"{name} {why}; its log {self._launcher.log_path(name)} ends:\n{self._launcher.log_tail(name)}"
        self.events.event(Severity.ERROR, process, why, "the run ends; see its log")

    # -- stop ----------------------------------------------------------------------------------------------------

    def stop(self) -> None:
        """Stop all processes but those that show the end, in order, each with its deadline (hurried: all at once)."""
        self._stopping = True
        self._block.set_state(SUPERVISOR_SLOT, SlotState.STOPPING)  # from now on the guardian sends for dead drivers
        for order in StopOrder:
            running = [p for p in self.processes if p.running]
            group = [p for p in running if p.spec.stop_order is order and not p.spec.shows_end]
            if self.interrupts.hurry and order is not StopOrder.GUARDS:
                group = [p for p in running if p.spec.stop_order is not StopOrder.GUARDS]
            self._stop_group(group)
        self._last_words.close()

    def _stop_group(self, group: list[ManagedProcess]) -> None:
        for process in group:
            process.signal(signal.SIGTERM)
            process.signal(signal.SIGCONT)  # a frozen one would not receive it
        began = time.monotonic()
        while alive := [p for p in group if p.running]:
            self.step()
            for process in alive:
                # Waiting for the guardian means waiting for a drone to land.
                hurry = self.interrupts.hurry and process.spec.stop_order is not StopOrder.GUARDS
                late_s = time.monotonic() - began - (_HURRY_S if hurry else process.spec.stop_limit_s)
                self._end_late(process, late_s)

    def _end_late(self, process: ManagedProcess, late_s: float) -> None:
        self._kill(process, "did not stop in time", late_s > 0)
        if late_s > 0 and process.running:
            _log.warning("%s did not stop in time: killed", process.spec.name)
        if late_s > _KERNEL_S and process.running:
            process.abandon()
            self.events.event(Severity.ERROR, process, f"cannot be killed (pid {process.pid}): left behind")

    def end_run(self) -> None:
        """Stop all processes but those that show the end, and leave the bus, for the run's verdict; idempotent."""
        self.stop()
        if self.bus is not None:
            self.bus.close()
            self.bus = self.events.bus = self._statuses = self._publisher = None
        self._entry.remove()
        go_back()

    def close(self) -> None:
        """Leave nothing behind: processes, heartbeat block, log files; idempotent."""
        self.end_run()
        self._stop_group([p for p in self.processes if p.running])
        if self._identities is not None:
            shutil.rmtree(self._identities, ignore_errors=True)
        self._launcher.close()
        self._block.remove()

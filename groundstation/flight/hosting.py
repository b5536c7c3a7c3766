"""Runs devices of a field on another host than the run's: awaits the order, starts, watches and stops the drivers.

These vehicles are supervised on that host, by the same supervisor class and a guardian of its own. The run's supervisor
is heard over the bus; the drivers see its silence as that of this process.
"""

import math
import time
from pathlib import Path

from pydantic import ValidationError

from groundstation.bus import clock
from groundstation.bus.door import why_closed
from groundstation.bus.messages import HostOrder, Lifecycle
from groundstation.bus.roles import Identity
from groundstation.bus.zenoh_bus import ZenohBus, open_bus
from groundstation.errors import GroundStationError
from groundstation.flight.composition import device_rows
from groundstation.flight.run_folder import log_to
from groundstation.process.heartbeat import HeartbeatBlock
from groundstation.runtime.liaison import VERSION
from groundstation.settings.schema import Field
from groundstation.supervisor.guard_order import guarded
from groundstation.supervisor.host_link import HostLink, OwnState
from groundstation.supervisor.process_spec import StopOrder
from groundstation.supervisor.run import Run
from groundstation.supervisor.site import Admission
from groundstation.supervisor.supervisor import Supervisor
from groundstation.supervisor.terminal import Terminal

_CONNECT_S, _TURN_S = 1.0, 0.05
# Time within which even a slowly loading run sends its order.
_IDLE_S = 30.0
_GUARDIAN_S = 10.0
# Drivers land long before; after this the run's supervisor will not return.
_LOST_S = 20.0
_FAREWELLS = 5


class Hosting:
    """Serves one run of a site: `wait` for it, then `serve` it."""

    def __init__(self, admission: Admission, identity: Identity, logs: Path, terminal: Terminal) -> None:
        self._admission, self._identity = admission, identity
        self._logs, self._terminal = logs, terminal
        self._own = OwnState()
        self._bus: ZenohBus | None = None

    def wait(self) -> HostOrder:
        """Return the order of the next run, once the offset of the clocks is known."""
        link = self._join()
        refused, idle_s = "", time.monotonic() + _IDLE_S
        while True:
            link.turn(clock.own_ns(), self._own)
            order = link.order
            why = "" if order is None else _refusal(order)
            if order is not None and why:
                self._own = OwnState(state=Lifecycle.DEGRADED, detail=f"{self._admission.host} {why}")
                if order.run != refused:
                    self._terminal.say(f"run {order.run} is not served: this host {why}")
                refused = order.run
            elif order is not None and link.synchronised and link.watches(clock.own_ns()):
                return order
            elif order is None and time.monotonic() > idle_s:
                self._say_idle()
                idle_s = math.inf
            time.sleep(_TURN_S)

    def _say_idle(self) -> None:
        host = self._admission.host
        self._terminal.say(
            f"{host} is let in, and gets nothing to do so far: if that stays, no device of the run has host: {host} in "
            "its field file, or this host was admitted after the run began (it takes part in the next one), or expelled"
        )

    def _join(self) -> HostLink:
        admission = self._admission
        self._terminal.say(f"{admission.host} waits for a run of {admission.site} at {admission.endpoint}")
        said = ""
        while self._bus is None:
            try:
                self._bus = open_bus(admission.endpoint, admission.site, admission.host, _CONNECT_S, self._identity)
            except GroundStationError:
                why = why_closed(admission.endpoint, self._identity)
                if why and why != said:
                    self._terminal.say(why)
                said = why
        self._link = HostLink(self._bus, admission.host)
        return self._link

    def serve(self, order: HostOrder) -> bool:
        """Run the devices of this host until the run ends; returns whether the operator here ended it."""
        admission, link = self._admission, self._link
        field = Field.model_validate_json(order.field)
        table = guarded(tuple(device_rows(field, admission.host)))
        run_dir = self._logs / order.run
        run_dir.mkdir(parents=True, exist_ok=True)
        log_to(run_dir)
        clock.follow(link.run_clock, lambda: link.offset_ns)
        identity = Identity(self._identity.folder, self._identity.name, order.run)
        run = Run(
            admission.site,
            "",
            admission.endpoint,
            run_dir,
            tuple(field.drones),
            source=admission.host,
            identity=identity,
            clock=link.run_clock,
        )
        self._terminal.say(f"run {order.run}: {', '.join(row.name for row in table)}; logs in {run_dir / 'log'}")
        supervisor = Supervisor(run, table, self._terminal, self._is_watched)
        try:
            why = self._why_over(supervisor, order.run)
            self._terminal.say(f"run {order.run}: {why}; drones of this host land")
        finally:
            detail = f"{admission.host} lands its drones: {link.stood}" if link.stood else ""
            self._own = OwnState(order.run, Lifecycle.STOPPING, detail)
            self._end(supervisor)
        return supervisor.interrupts.stop_requested  # even if it came while the drones landed

    def _why_over(self, supervisor: Supervisor, run: str) -> str:
        """Run the devices and return why they stopped; a failure ends only this run, and the next one is served."""
        try:
            self._start(supervisor)
            return self._watch(supervisor, run)
        except GroundStationError as error:
            return str(error)

    def _is_watched(self, block: HeartbeatBlock) -> bool:
        now_ns, link = clock.own_ns(), self._link
        link.turn(now_ns, self._own)
        block.set_clock_offset(link.offset_ns)
        return link.watches(now_ns)

    def _start(self, supervisor: Supervisor) -> None:
        """Start the guardian, then the drivers, so that it covers any that die."""
        self._own = OwnState(supervisor.run.name)
        supervisor.prepare()
        guards = [one for one in supervisor.processes if one.spec.stop_order is StopOrder.GUARDS]
        for process in guards:
            supervisor.launch(process)
        deadline_s = time.monotonic() + _GUARDIAN_S
        while not all(one.is_up for one in guards) and time.monotonic() < deadline_s and not supervisor.failure:
            supervisor.step()
        supervisor.connect()
        for process in supervisor.processes:
            if process not in guards:
                supervisor.launch(process)

    def _watch(self, supervisor: Supervisor, run: str) -> str:
        """Continue until there is a reason to stop, and return it."""
        link = self._link
        while True:
            supervisor.step()
            unwell = ", ".join(supervisor.unwell)
            state = Lifecycle.DEGRADED if unwell else Lifecycle.READY
            self._own = OwnState(run, state, f"not well on {self._admission.host}: {unwell}" if unwell else "")
            if supervisor.failure:
                return supervisor.failure
            if supervisor.interrupts.stop_requested:
                return "stopped here"
            if link.ends:
                return "it ends"
            if link.stood:
                return link.stood
            if link.order is not None and link.order.run != run:
                return "another one has begun"
            if link.silent_s(clock.own_ns()) > _LOST_S:
                return f"nothing was heard of it for {_LOST_S:.0f} s"

    def _end(self, supervisor: Supervisor) -> None:
        """End all processes of the run, and report that none is left on this host."""
        try:
            supervisor.stop()
            self._own = OwnState()
            for _ in range(_FAREWELLS):  # before the supervisor leaves the bus, which may last longer than a silence
                self._link.turn(clock.own_ns(), self._own)
                time.sleep(_TURN_S)
        finally:
            supervisor.close()
            if self._bus is not None:
                self._bus.close()


def _refusal(order: HostOrder) -> str:
    """Return why a run cannot be served here, or ""."""
    if order.version != VERSION:
        return f"has version {VERSION}, the run {order.version}: install the same"
    try:
        Field.model_validate_json(order.field)
    except ValidationError as error:
        first = error.errors()[0]
        return f"cannot read the field: {'.'.join(map(str, first['loc']))}: {first['msg']}; install the same version"
    return ""

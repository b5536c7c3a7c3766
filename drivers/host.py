"""What every vehicle driver shares: orders in, acknowledgements, status and events out, and the sender loop."""

import itertools
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace

from drivers.base import HostProcess, Vehicle
from drivers.control_error import ControlErrorMonitor
from drivers.neighbours import Neighbours
from drivers.seen_velocity import SeenVelocity
from drivers.watchdog import Watchdog
from drivers.watchdog_types import Ack, DriverMode, Upstream, VehicleView, WatchdogDecision, WatchdogLimits
from groundstation.adapters import how_to_reach
from groundstation.bus import clock
from groundstation.bus.messages import (
    AIRBORNE,
    OPERATOR,
    Command,
    CommandAck,
    Estimate,
    FlightState,
    Lease,
    Severity,
    VehicleStatus,
    VelocitySetpoint,
)
from groundstation.bus.topics import COMMAND, COMMAND_ACK, ESTIMATE, LEASE, SETPOINT, VEHICLE_STATUS
from groundstation.process.priority import go_first
from groundstation.process.refusals import Refusals
from groundstation.time_units import NEVER_NS, NS_PER_MS, NS_PER_S

RATE_HZ = 30.0
_STATUS_PERIOD_NS, _FLUSH_PERIOD_NS, _FLOOD_NS = 200 * NS_PER_MS, 100 * NS_PER_MS, 10 * NS_PER_MS
_UNANSWERED_NS, _UNCONFIGURED_NS = 5 * NS_PER_S, 15 * NS_PER_S
_SILENCE_EVENT_NS = _REFUSAL_PERIOD_NS = NS_PER_S
# How long a driver that is to exit goes on for a vehicle it cannot hear.
_GIVE_UP_NS = 10 * NS_PER_S
_UNSOUND = "restart it; if it says this again, have that sensor repaired"
# Refusals that nothing of ours causes, as the operator reads them.
_INTRUSIONS = {
    "unsigned": "unsigned frames",
    "signature": "frames signed with another key",
    "duplicate_system": "frames of a second vehicle with its number",
    "foreign_address": "datagrams from another address",
    "setpoint_other_source": "setpoints of another sender",
    "setpoint_epoch_leap": "setpoints of an epoch far ahead",
    "lease_held": "operator leases of another sender",
}


class VehicleHost:
    """One vehicle on the bus: feeds its watchdog, applies and publishes the decisions."""

    def __init__(self, child: HostProcess, vehicle: Vehicle, limits: WatchdogLimits) -> None:
        self.vehicle = vehicle
        self.watchdog = Watchdog(limits, clock.clock_id(), child.bus.run, child.spoken_for_ns)
        self._child = child
        self._bus = child.bus
        self._setpoints = self._bus.subscribe([SETPOINT], entity=vehicle.name, newest=True)
        self._commands = self._bus.subscribe([COMMAND], capacity=256)
        self._leases = self._bus.subscribe([LEASE], capacity=64)
        self._ignored: Counter[str] = Counter()
        self._started_ns = clock.now_ns()
        self._next_status_ns = self._next_flush_ns = self._turned_ns = 0
        self._heard_ns = self._unconfigured_ns = self._started_ns
        self._announced = (self.watchdog.mode, self.watchdog.reason)
        self._silent = False
        self._estimates = self._bus.subscribe([ESTIMATE], newest=True)
        self._seen, self._control_error = SeenVelocity(), ControlErrorMonitor()
        self._told: WatchdogDecision | None = None
        self._next_refusal_ns = 0
        self._statuses = self._bus.subscribe([VEHICLE_STATUS], newest=True)
        self._neighbours = Neighbours(vehicle.name, limits.pad_m, limits.min_separation_m)
        self._localised_ns: int | None = None
        self._intrusions = Refusals(_INTRUSIONS)

    def call_on_commands(self, wake: Callable[[], None]) -> None:
        """Have a function called, on the network's thread, whenever a command arrives."""
        self._commands.on_arrival = wake

    def call_on_setpoints(self, wake: Callable[[], None]) -> None:
        """Have a function called, on the network's thread, whenever a setpoint arrives."""
        self._setpoints.on_arrival = wake

    def due_ns(self) -> int:
        """Return when a setpoint or command asks for a turn; a flood of commands waits a little."""
        asked_ns = self._turned_ns + _FLOOD_NS if self._commands.waiting else NEVER_NS
        return 0 if self._setpoints.waiting else asked_ns

    def turn(self, now_ns: int) -> WatchdogDecision:
        """Run one cycle: orders, decision, command to the vehicle, reports."""
        self._turned_ns = now_ns
        for received in self._leases.drain():
            if isinstance(received.message, Lease):
                self._count("lease", self.watchdog.accept_lease(now_ns, received.message))
        view = self._judge(now_ns, self.vehicle.view(now_ns).plausible)
        self.watchdog.see(view, self._upstream())
        for received in self._commands.drain():
            if isinstance(received.message, Command):
                self._command(now_ns, received.message)
        for received in self._setpoints.drain():
            if isinstance(received.message, VelocitySetpoint):
                self._count("setpoint", self.watchdog.accept_setpoint(now_ns, received.message))
        decision = self.watchdog.step(now_ns, view, self._upstream())
        self._told = decision = replace(decision, seen_m_s=self._seen.velocity(now_ns))
        self.vehicle.apply(now_ns, decision)
        self._report(now_ns, view, decision)
        return decision

    def _judge(self, now_ns: int, view: VehicleView) -> VehicleView:
        """Add to a view the vehicle's control error, and the tracker's estimates of it and of the others."""
        for received in self._estimates.drain():
            if isinstance(received.message, Estimate):
                self._hear_estimate(now_ns, received.message)
        view = self._control_error.judge(now_ns, view, self._told, self._seen.velocity(now_ns))
        if view.flight_state not in AIRBORNE:
            self._localised_ns = None
        unlocalised_s = 0.0 if self._localised_ns is None else (now_ns - self._localised_ns) / NS_PER_S
        return replace(view, unseen_s=unlocalised_s, near=self._near(now_ns, view))

    def _hear_estimate(self, now_ns: int, estimate: Estimate) -> None:
        self._neighbours.see(now_ns, estimate.entities)
        for entity in estimate.entities:
            if entity.name == self.vehicle.name:
                self._seen.hear(now_ns, estimate.epoch, entity)
                if math.isfinite(entity.unlocalised_s):
                    self._localised_ns = now_ns - round(entity.unlocalised_s * NS_PER_S)

    def _near(self, now_ns: int, view: VehicleView) -> str:
        """Return who in the air is too near to the pad of a vehicle that stands."""
        for received in self._statuses.drain():
            if isinstance(received.message, VehicleStatus):
                self._neighbours.hear(received.message)
        return "" if view.flight_state in AIRBORNE else self._neighbours.obstacle(now_ns)

    def is_finished(self, now_ns: int) -> bool:
        """Return whether a driver that is to exit may: no motor turns any more, or the vehicle was silent too long."""
        if not self._child.stop_requested and self._child.supervisor_alive:
            return False
        state, mode = self.watchdog.vehicle, self.watchdog.mode
        if mode in (DriverMode.CONNECTING, DriverMode.LANDED):
            return True
        still = state.fresh and state.flight_state in (FlightState.EMERGENCY, FlightState.LANDED)
        return (mode is DriverMode.CUT and still) or now_ns - self._heard_ns > _GIVE_UP_NS

    def publish_status(self, now_ns: int) -> None:
        """Publish the VehicleStatus now, and report refused messages from outside of the run."""
        health, view = self.vehicle.health(now_ns), self.watchdog.vehicle
        lost = self.watchdog.mode is not DriverMode.CONNECTING and not view.fresh
        status = VehicleStatus(
            header=self._bus.header(self.vehicle.name),
            flight_state=FlightState.LOST if lost else view.flight_state,
            mode=self.watchdog.mode,
            failsafe=self.watchdog.failsafe,
            battery=view.battery,
            link_quality=health.link_quality,
            rate_hz=health.rate_hz,
            rejected=health.rejected | self._ignored | self._refused(),
            detail=health.detail or self.watchdog.explanation,
            not_ready=view.not_ready,
            firmware=health.firmware,
            braked=self.watchdog.braked,
            lands_in_s=self.watchdog.lands_in_s,
            clock_drift_ppm=None if health.clock is None else health.clock.drift_ppm,
            telemetry_late_ms=None if health.clock is None else health.clock.late_ms,
            asks_time=health.asks_time,
        )
        self._bus.publish(VEHICLE_STATUS, status)
        if refused := self._intrusions.news(now_ns, status.rejected):
            self._event(Severity.WARNING, f"{self.vehicle.name} refused {refused}")

    def _upstream(self) -> Upstream:
        return Upstream(self._child.supervisor_alive, self._child.supervisor_fresh, self._child.stop_requested)

    def _count(self, what: str, reason: str) -> None:
        if reason:
            self._ignored[f"{what}_{reason}"] += 1

    def _refused(self) -> Counter[str]:
        total: Counter[str] = Counter()
        for name, subscription in (("setpoint", self._setpoints), ("command", self._commands), ("lease", self._leases)):
            total.update({f"{name}_{reason}": n for reason, n in subscription.refused.items()})
        return total

    def _command(self, now_ns: int, command: Command) -> None:
        if OPERATOR in command.scope or (command.scope and self.vehicle.name not in command.scope):
            return
        self._announce_refusal(now_ns, command)
        for ack in self.watchdog.accept_command(now_ns, command):
            self._answer(ack)

    def _announce_refusal(self, now_ns: int, command: Command) -> None:
        """Report a command without the right to give it; once a second, and once for each."""
        reason = "" if self.watchdog.has_answered(command) else self.watchdog.lease.refusal(now_ns, command)
        if not reason:
            return
        self._count("command", "unauthorised")
        if now_ns >= self._next_refusal_ns:
            self._next_refusal_ns = now_ns + _REFUSAL_PERIOD_NS
            self._event(Severity.WARNING, f"{command.verb} of {command.header.source} refused: {reason}")

    def _answer(self, ack: Ack) -> None:
        header = self._bus.header(self.vehicle.name)
        message = CommandAck(
            header=header, command_id=ack.command_id, verb=ack.verb, stage=ack.stage, reason=ack.reason
        )
        self._bus.publish(COMMAND_ACK, message)

    def _report(self, now_ns: int, view: VehicleView, decision: WatchdogDecision) -> None:
        for ack in decision.acks:
            self._answer(ack)
        self._announce_mode(decision)
        self._announce_silence(now_ns, view, decision)
        if now_ns >= self._next_flush_ns:
            self._next_flush_ns = now_ns + _FLUSH_PERIOD_NS
            self.vehicle.flush()
        if now_ns >= self._next_status_ns:
            self._next_status_ns = now_ns + _STATUS_PERIOD_NS
            self.publish_status(now_ns)

    def _announce_mode(self, decision: WatchdogDecision) -> None:
        if (decision.mode, decision.reason) == self._announced:
            return
        if decision.mode is not self._announced[0]:
            # The status of a changed mode must not wait: the tracker learns from it who is airborne.
            self._next_status_ns = 0
        self._announced = (decision.mode, decision.reason)
        cut, sinks = decision.mode is DriverMode.CUT, decision.mode is DriverMode.LANDING and self.watchdog.failsafe
        severity = Severity.ERROR if cut else Severity.WARNING if sinks else Severity.INFO
        self._event(severity, f"{self.vehicle.name} {decision.mode}: {decision.reason}")

    def _announce_silence(self, now_ns: int, view: VehicleView, decision: WatchdogDecision) -> None:
        name, address = self.vehicle.name, self.vehicle.address
        if view.fresh:
            self._heard_ns = now_ns
            self._announce_start(now_ns, view, decision)
            if self._silent:
                self._event(Severity.INFO, f"{name} answers")
            self._silent = False
            return
        limit_ns = _UNANSWERED_NS if decision.mode is DriverMode.CONNECTING else _SILENCE_EVENT_NS
        if not self._silent and now_ns - self._heard_ns >= limit_ns:
            self._silent = True
            if view.unsound and decision.mode is not DriverMode.CONNECTING:  # the watchdog's reason says what
                return
            told = f"{name}: {view.silence}" if view.unsound else f"{name} does not answer at {address}"
            remedy = _UNSOUND if view.unsound else how_to_reach(address)
            self._event(Severity.ERROR, f"{told}; trying on", remedy)
            self._child.degrade(told)

    def _announce_start(self, now_ns: int, view: VehicleView, decision: WatchdogDecision) -> None:
        """Say READY once the vehicle may take off, or at once when it flies: then it has to be spoken for."""
        name, address = self.vehicle.name, self.vehicle.address
        if view.configured or view.flight_state in AIRBORNE:
            self._unconfigured_ns = now_ns
            if self._silent or decision.mode is not DriverMode.CONNECTING:
                self._child.ready(f"{name} at {address}")
        elif now_ns - self._unconfigured_ns > _UNCONFIGURED_NS:
            self._child.degrade(f"{name} at {address}: {view.not_ready}")

    def _event(self, severity: Severity, text: str, remedy: str = "") -> None:
        self._child.event(severity, text, remedy, self.vehicle.name)


def fly_one(
    child: HostProcess,
    vehicle: Vehicle,
    limits: WatchdogLimits,
    rate_hz: float = RATE_HZ,
    before: Callable[[int], None] = lambda now_ns: None,
) -> int:
    """Fly one vehicle until a stop is requested, then close its link; see `run_hosts`."""
    try:
        go_first()
        return run_hosts(child, [VehicleHost(child, vehicle, limits)], rate_hz, before)
    finally:
        vehicle.close()


def run_hosts(
    child: HostProcess,
    hosts: Sequence[VehicleHost],
    rate_hz: float = RATE_HZ,
    before: Callable[[int], None] = lambda now_ns: None,
) -> int:
    """Turn all hosts at the sender's rate, and at once on a command, until each is finished; returns the exit code 0.

    before: what the vehicles of one link share, done ahead of each turn.
    """
    period_ns, overruns = round(1e9 / rate_hz), 0
    for host in hosts:
        host.call_on_commands(child.wake)
    deadline_ns = clock.now_ns()
    for tick in itertools.count(1):
        now_ns = clock.now_ns()
        before(now_ns)
        for host in hosts:
            host.turn(now_ns)
        child.beat()
        child.tick_status(tick, overruns)
        if all(host.is_finished(now_ns) for host in hosts):
            break
        deadline_ns += period_ns
        if deadline_ns < clock.now_ns():
            overruns += 1
            deadline_ns = clock.now_ns()
        sleep_serving(child, hosts, deadline_ns)
    for host in hosts:
        host.publish_status(clock.now_ns())
    return 0


def sleep_serving(child: HostProcess, hosts: Sequence[VehicleHost], deadline_ns: int) -> None:
    """Sleep until the next turn; a host whose orders call `child.wake` turns at once when one arrives."""
    while child.sleep_until(min(deadline_ns, *(host.due_ns() for host in hosts))) and clock.now_ns() < deadline_ns:
        for host in hosts:
            if host.due_ns() <= (now_ns := clock.now_ns()):
                host.turn(now_ns)

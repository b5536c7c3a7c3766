"""The part that all vehicle drivers share: orders in, acknowledgements and status out, and the sender loop."""

import itertools
from collections import Counter
from collections.abc import Callable, Sequence

from drivers.announcements import Announcements
from drivers.base import HostProcess, Vehicle
from drivers.coming_down import ComingDown, away
from drivers.control_error import ControlErrorMonitor
from drivers.fence import FenceWatch
from drivers.neighbours import Neighbours
from drivers.seen_velocity import SeenVelocity
from drivers.start_report import StartReport
from drivers.touch_down import TouchDown
from drivers.unlocalised_time import UnlocalisedTime
from drivers.watchdog import Watchdog
from drivers.watchdog_types import Ack, Action, DriverMode, Upstream, VehicleView, WatchdogDecision, WatchdogLimits
from groundstation.bus import clock
from groundstation.bus.api import Sample, decode_sample
from groundstation.bus.messages import (
    AIRBORNE,
    OPERATOR,
    Command,
    CommandAck,
    Estimate,
    FlightState,
    Lease,
    VehicleStatus,
    VelocitySetpoint,
)
from groundstation.bus.topics import COMMAND, COMMAND_ACK, ESTIMATE, LEASE, SETPOINT, VEHICLE_STATUS
from groundstation.errors import MessageError
from groundstation.process.priority import go_first
from groundstation.time_units import NEVER_NS, NS_PER_MS, NS_PER_S

RATE_HZ = 30.0
_STATUS_PERIOD_NS, _FLUSH_PERIOD_NS, _FLOOD_NS = 200 * NS_PER_MS, 100 * NS_PER_MS, 10 * NS_PER_MS
# How long a driver that is to exit waits for a silent vehicle.
_GIVE_UP_NS = 10 * NS_PER_S


class VehicleHost:
    """One vehicle on the bus: feeds its watchdog, applies and publishes the decisions.

    start: that of the process, if it has other vehicles too.
    """

    def __init__(
        self, child: HostProcess, vehicle: Vehicle, limits: WatchdogLimits, start: StartReport | None = None
    ) -> None:
        self.vehicle = vehicle
        self.watchdog = Watchdog(limits, clock.clock_id(), child.bus.run, child.spoken_for_ns)
        self._child = child
        self._bus = child.bus
        self._setpoints = self._bus.subscribe([SETPOINT], entity=vehicle.name, newest=True)
        self._commands = self._bus.subscribe([COMMAND], capacity=256)
        self._commands.admits = self._is_for_it  # many orders to others must not displace a LAND
        self._leases = self._bus.subscribe([LEASE], capacity=64)
        self._ignored: Counter[str] = Counter()
        self._next_status_ns = self._next_flush_ns = self._turned_ns = 0
        start = start or StartReport(child, [vehicle.name])
        self._announcements = Announcements(child, vehicle, self.watchdog.mode, self.watchdog.reason, start)
        self._estimates = self._bus.subscribe([ESTIMATE], newest=True)
        self._seen, self._control_error = SeenVelocity(), ControlErrorMonitor()
        self._told: WatchdogDecision | None = None
        self._statuses = self._bus.subscribe([VEHICLE_STATUS], newest=True)
        self._neighbours = Neighbours(vehicle.name, limits.pad_m, limits.min_separation_m, limits.max_speed_m_s)
        self._unlocalised, self._touch_down, self._coming_down = UnlocalisedTime(), TouchDown(), ComingDown()
        self._fence = FenceWatch(limits.fence_m, limits.max_speed_m_s, limits.max_climb_m_s)

    def call_on_commands(self, wake: Callable[[], None]) -> None:
        """Have a function called, on the network's thread, whenever a command arrives."""
        self._commands.on_arrival = wake

    def call_on_setpoints(self, wake: Callable[[], None]) -> None:
        """Have a function called, on the network's thread, whenever a setpoint arrives."""
        self._setpoints.on_arrival = wake

    @property
    def overflowed(self) -> int:
        """Return how many orders and leases were dropped unread."""
        return self._commands.overflowed + self._leases.overflowed

    def due_ns(self) -> int:
        """Return when a setpoint or command requires a turn; a flood of commands waits a little."""
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
        seen, why = self._seen.velocity(now_ns), self.watchdog.failsafe
        self._told = decision = decision._replace(seen_m_s=seen, failsafe=why)
        self.vehicle.apply(now_ns, decision)
        self._report(now_ns, view, decision)
        return decision

    def _judge(self, now_ns: int, view: VehicleView) -> VehicleView:
        """Add to a view the vehicle's control error, and the tracker's estimates of it and of the others."""
        for received in self._estimates.drain():
            if isinstance(received.message, Estimate):
                self._hear_estimate(now_ns, received.message)
        seen_m_s, climb_m_s = self._seen.velocity(now_ns), self._seen.climb(now_ns)
        view = self._control_error.judge(now_ns, view, self._told, seen_m_s, climb_m_s)
        aloft = view.flight_state in AIRBORNE
        near, crowded = self._near(now_ns, aloft)
        unseen_s, touches = self._unlocalised.of_flight(now_ns, aloft), self._touch_down.of_flight(aloft)
        flies_away = away(seen_m_s, climb_m_s, self.watchdog.limits.tolerated_speed_m_s)
        return view._replace(
            height_m=self._coming_down.height_m, away=flies_away, touches_down=touches, on_floor=self._touch_down.low,
            unseen_s=unseen_s, near=near, crowded=crowded, outside=self._fence.outside(now_ns, view.flown_by_others),
        )  # fmt: skip

    def _hear_estimate(self, now_ns: int, estimate: Estimate) -> None:
        self._neighbours.see(now_ns, estimate.entities)
        for entity in estimate.entities:
            if entity.name == self.vehicle.name:
                self._seen.take(now_ns, estimate.epoch, entity)
                self._unlocalised.hear(now_ns, entity)
                self._touch_down.hear(entity)
                self._coming_down.hear(entity)
                self._fence.hear(now_ns, entity)

    def _near(self, now_ns: int, aloft: bool) -> tuple[str, str]:
        """Return the neighbour too near to this vehicle's pad, if it stands, and to it, if it flies; "" if none is."""
        for received in self._statuses.drain():
            if isinstance(received.message, VehicleStatus):
                self._neighbours.take(received.message)
        return ("", self._neighbours.crowded(now_ns)) if aloft else (self._neighbours.obstacle(now_ns), "")

    def is_finished(self, now_ns: int) -> bool:
        """Return whether a driver that is to exit may: no motor turns, or the vehicle has been silent too long."""
        if not self._child.stop_requested and self._child.supervisor_alive:
            return False
        state, mode = self.watchdog.vehicle, self.watchdog.mode
        if mode in (DriverMode.CONNECTING, DriverMode.LANDED):
            return self._told is None or self._told.action is not Action.LAND
        still = state.fresh and state.flight_state in (FlightState.EMERGENCY, FlightState.LANDED)
        return (mode is DriverMode.CUT and still) or now_ns - self._announcements.heard_ns > _GIVE_UP_NS

    def publish_status(self, now_ns: int) -> None:
        """Publish the VehicleStatus now, and report refused messages from outside of the run."""
        health, view = self.vehicle.health(now_ns), self.watchdog.vehicle
        lost = self.watchdog.mode is not DriverMode.CONNECTING and not view.fresh
        status = VehicleStatus(
            header=self._bus.header(self.vehicle.name),
            flight_state=FlightState.LOST if lost else view.flight_state,
            mode=self.watchdog.mode,
            failsafe=self.watchdog.told or self.watchdog.failsafe,
            battery=view.battery,
            link_quality=health.link_quality,
            rate_hz=health.rate_hz,
            rejected=health.rejected | self._ignored | self._refused(),
            detail=self._detail(health.detail),
            not_ready=view.not_ready,
            firmware=health.firmware,
            braked=self.watchdog.braked,
            lands_in_s=self.watchdog.lands_in_s,
            clock_drift_ppm=None if health.clock is None else health.clock.drift_ppm,
            telemetry_late_ms=None if health.clock is None else health.clock.late_ms,
            asks_time=health.asks_time,
        )
        self._bus.publish(VEHICLE_STATUS, status)
        self._announcements.tell_intrusions(now_ns, status.rejected)

    def _detail(self, of_link: str) -> str:
        """Return the reason for a vehicle's present action; if no failsafe acts, a wait of its link comes first."""
        stands, view = self.watchdog.mode is DriverMode.LANDED, self.watchdog.vehicle
        if self.watchdog.braked or self.watchdog.told or (self.watchdog.failsafe and not stands):
            return self.watchdog.explanation
        unheard = view.silence if stands and not view.fresh else ""
        return of_link or unheard or self.watchdog.explanation

    def _upstream(self) -> Upstream:
        return Upstream(self._child.supervisor_alive, self._child.supervisor_fresh, self._child.stop_requested)

    def _count(self, what: str, reason: str) -> None:
        if reason:
            self._ignored[f"{what}_{reason}"] += 1

    def _refused(self) -> Counter[str]:
        total: Counter[str] = Counter()
        for name, subscription in (("setpoint", self._setpoints), ("command", self._commands), ("lease", self._leases)):
            total.update({f"{name}_{reason}": n for reason, n in subscription.refused.items()})
        return total + Counter(overflow=self.overflowed)

    def _is_for_it(self, sample: Sample) -> bool:
        """Return whether an order is addressed to this vehicle, or is malformed, which is counted later; any thread."""
        try:
            message = decode_sample(sample).message
        except MessageError:
            return True
        scope = message.scope if isinstance(message, Command) else ()
        return OPERATOR not in scope and (not scope or self.vehicle.name in scope)

    def _command(self, now_ns: int, command: Command) -> None:
        self._refuse_strangers(now_ns, command)
        for ack in self.watchdog.accept_command(now_ns, command):
            self._answer(ack)

    def _refuse_strangers(self, now_ns: int, command: Command) -> None:
        """Count and report a command from a sender without the right to give it; repetitions count once."""
        reason = "" if self.watchdog.has_answered(command) else self.watchdog.lease.refusal(now_ns, command)
        if reason:
            self._count("command", "unauthorised")
            self._announcements.tell_refusal(now_ns, command, reason)

    def _answer(self, ack: Ack) -> None:
        header = self._bus.header(self.vehicle.name)
        message = CommandAck(
            header=header,
            command_id=ack.command_id,
            verb=ack.verb,
            stage=ack.stage,
            reason=ack.reason,
            final=ack.final,
        )
        self._bus.publish(COMMAND_ACK, message)

    def _report(self, now_ns: int, view: VehicleView, decision: WatchdogDecision) -> None:
        for ack in decision.acks:
            self._answer(ack)
        if self._announcements.tell_mode(decision, self.watchdog.failsafe):
            # A status with a changed mode must not wait: it tells the tracker which drones are airborne.
            self._next_status_ns = 0
        self._announcements.tell_landing(self.watchdog.told, self.watchdog.explanation)
        self._announcements.tell_silence(now_ns, view, decision.mode)
        if now_ns >= self._next_flush_ns:
            self._next_flush_ns = now_ns + _FLUSH_PERIOD_NS
            self.vehicle.flush()
        if now_ns >= self._next_status_ns:
            self._next_status_ns = now_ns + _STATUS_PERIOD_NS
            self.publish_status(now_ns)


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

    before: work that the vehicles of one link share, done ahead of each turn.
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
        child.tick_status(tick, overruns, sum(host.overflowed for host in hosts))
        if all(host.is_finished(now_ns) for host in hosts):
            break
        deadline_ns += period_ns
        if deadline_ns < clock.now_ns():
            overruns += 1
            deadline_ns = clock.now_ns()
        sleep_serving(child, hosts, deadline_ns)
    child.finish()
    for host in hosts:
        host.publish_status(clock.now_ns())
    return 0


def sleep_serving(child: HostProcess, hosts: Sequence[VehicleHost], deadline_ns: int) -> None:
    """Sleep until the next turn; a host whose orders call `child.wake` turns at once when one arrives."""
    while child.sleep_until(min(deadline_ns, *(host.due_ns() for host in hosts))) and clock.now_ns() < deadline_ns:
        for host in hosts:
            if host.due_ns() <= (now_ns := clock.now_ns()):
                host.turn(now_ns)

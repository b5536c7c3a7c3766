"""Events about a vehicle for the operator: its modes, silence and refusals, each reported once per change."""

from collections.abc import Mapping

from drivers.base import HostProcess, Vehicle
from drivers.start_report import StartReport
from drivers.watchdog_types import DriverMode, VehicleView, WatchdogDecision
from groundstation.adapters import how_to_reach
from groundstation.bus import clock
from groundstation.bus.messages import AIRBORNE, Command, Severity
from groundstation.process.refusals import Refusals
from groundstation.time_units import NS_PER_S

_UNANSWERED_NS, _UNCONFIGURED_NS = 5 * NS_PER_S, 15 * NS_PER_S
_SILENCE_EVENT_NS = _REFUSAL_PERIOD_NS = NS_PER_S
NOT_DOWN = "stay away; CUT MOTORS, or the kill switch of its transmitter, stops its motors: in the air it falls then"
_STANDS = frozenset({DriverMode.CONNECTING, DriverMode.LANDED})
_UNSOUND = "restart it; if it says this again, have that sensor repaired"
# Refusals caused from outside of this run, in the operator's words.
_INTRUSIONS = {
    "unsigned": "unsigned frames",
    "wrong_flavour": "heartbeats of another firmware than the field says",
    "signature": "frames signed with another key",
    "duplicate_system": "frames with its number from a second address (another vehicle, or it was restarted there)",
    "own_id": "heartbeats of another ground station with our system id (give that one another id, or end it)",
    "foreign_address": "datagrams from another address",
    "second_publisher": "odometry of a second publisher beside the first one, which counts (end the other node)",
    "heir_in_flight": "odometry of a publisher that took over in flight and does not continue the former one (after"
    " the landing end all but its own node, then this run)",
    "setpoint_other_source": "setpoints of another sender",
    "setpoint_epoch_leap": "setpoints of an epoch far ahead",
    "overflow": "orders and leases unread, as too many came at once (a member of the run floods it)",
    "lease_held": "operator leases of another sender",
}


class Announcements:
    """Events of one vehicle. heard_ns: time of its last telemetry; initially of its driver's start."""

    def __init__(self, child: HostProcess, vehicle: Vehicle, mode: DriverMode, reason: str, start: StartReport) -> None:
        self._child, self._vehicle, self._start = child, vehicle, start
        self._told = (mode, reason)
        self._silent = False
        self._alerts: frozenset[str] = frozenset()
        self._intrusions = Refusals(_INTRUSIONS)
        self._next_refusal_ns = 0
        self.heard_ns = self._unconfigured_ns = clock.now_ns()

    def tell_mode(self, decision: WatchdogDecision, failsafe: str) -> bool:
        """Report a new mode or reason.

        Returns whether the mode has changed. failsafe: the row of the table that caused it.
        """
        before, self._told = self._told, (decision.mode, decision.reason)
        if before != self._told:
            self._alerts = frozenset()
            cut, sinks = decision.mode is DriverMode.CUT, decision.mode is DriverMode.LANDING and failsafe
            severity = Severity.ERROR if cut else Severity.WARNING if sinks else Severity.INFO
            self._event(severity, f"{self._vehicle.name} {decision.mode}: {decision.reason}")
        return before[0] is not decision.mode

    def tell_landing(self, told: str, why: str) -> None:
        """Report once per landing each way in which it does not come down; told: the row of the table, or ""."""
        if told and told not in self._alerts:
            self._event(Severity.ERROR, f"{self._vehicle.name}: {why}", NOT_DOWN)
        self._alerts |= {told}

    def tell_refusal(self, now_ns: int, command: Command, reason: str) -> None:
        """Report a command from a sender without the right to give it, at most once a second."""
        if now_ns >= self._next_refusal_ns:
            self._next_refusal_ns = now_ns + _REFUSAL_PERIOD_NS
            self._event(Severity.WARNING, f"{command.verb} of {command.header.source} refused: {reason}")

    def tell_intrusions(self, now_ns: int, rejected: Mapping[str, int]) -> None:
        """Report refused messages from outside of the run; rejected: their numbers so far, by reason."""
        if refused := self._intrusions.news(now_ns, rejected):
            self._event(Severity.WARNING, f"{self._vehicle.name} refused {refused}")

    def tell_silence(self, now_ns: int, view: VehicleView, mode: DriverMode) -> None:
        """Report when the vehicle falls silent or answers again, and whether the driver is ready."""
        name, address = self._vehicle.name, self._vehicle.address
        if view.fresh:
            self.heard_ns = now_ns
            self._tell_start(now_ns, view, mode)
            if self._silent:
                self._event(Severity.INFO, f"{name} answers")
            self._silent = False
            return
        limit_ns = _UNANSWERED_NS if mode is DriverMode.CONNECTING else _SILENCE_EVENT_NS
        if not self._silent and now_ns - self.heard_ns >= limit_ns:
            self._silent = True
            if view.unsound and mode not in _STANDS:  # the watchdog's reason names the fault
                return
            heard = view.unsound or view.mute
            told = f"{name}: {view.silence}" if heard else f"{name} does not answer at {address}"
            remedy = _UNSOUND if view.unsound else "" if heard else how_to_reach(address)
            self._event(Severity.ERROR, f"{told}; trying on", remedy)
            self._start.degrade(name, told, heard=mode is not DriverMode.CONNECTING)

    def _tell_start(self, now_ns: int, view: VehicleView, mode: DriverMode) -> None:
        """Report READY once the vehicle may take off, or at once if it flies and needs commands."""
        name, address = self._vehicle.name, self._vehicle.address
        if view.configured or view.flight_state in AIRBORNE:
            self._unconfigured_ns = now_ns
            if self._silent or mode is not DriverMode.CONNECTING:
                self._start.ready(name, f"{name} at {address}", view.flight_state in AIRBORNE)
        elif now_ns - self._unconfigured_ns > _UNCONFIGURED_NS:
            self._start.degrade(name, f"{name} at {address}: {view.not_ready}")

    def _event(self, severity: Severity, text: str, remedy: str = "") -> None:
        self._child.event(severity, text, remedy, self._vehicle.name)

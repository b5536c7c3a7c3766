"""Decides who may move a vehicle, and its present action: one state machine for all kinds of vehicles.

Pure: `now_ns` and inputs in, a decision out. Priority: CUT_MOTORS > LAND > HOLD > setpoint > TAKEOFF. LAND latches
until a new TAKEOFF. Stops without an order follow the table of `failsafe_table.py`. Tables:
docs/explanation/authority.md#the-watchdog.
"""

from drivers.acknowledgements import AckBook
from drivers.failsafe_evidence import Evidence, Outlook, Situation, observed
from drivers.failsafe_table import RESUME_NEEDED, UNRESUMED, Condition, Failsafe, Latch, Reaction, failsafes
from drivers.lease import LeaseBook
from drivers.setpoints import SetpointGate
from drivers.watchdog_types import (
    ALOFT,
    FREE,
    Ack,
    Action,
    DriverMode,
    Upstream,
    VehicleView,
    WatchdogDecision,
    WatchdogLimits,
)
from drivers.way_back import WayBack
from groundstation.bus.messages import (
    AIRBORNE,
    KEPT_IN_PLACE,
    STANDING,
    UNHEARD,
    UP,
    AckStage,
    Command,
    FlightState,
    Lease,
    Vector3,
    VelocitySetpoint,
    Verb,
)
from groundstation.time_units import NS_PER_S

# LAND is sent for at least this long, even to a vehicle that reports standing: the report may be wrong. So is CUT, even
# if a LAND follows it at once.
_TELLS_NS = NS_PER_S
_CLEARED = "it was in an emergency: this order ends that and starts nothing; order TAKEOFF again"
_ENTERED = {Reaction.CUT: DriverMode.CUT, Reaction.LAND: DriverMode.LANDING, Reaction.HOVER: DriverMode.HOVER}


class Watchdog:
    """Authority over one vehicle. Feed it with `accept_*`, then call `step` at the sender's rate.

    mode, reason: see `WatchdogDecision`; failsafe: condition of the row that caused the mode, or "". The last states of
    vehicle and upstream are kept between steps. braked_ns: for how long others had commanded a hover when this driver
    started.
    """

    def __init__(self, limits: WatchdogLimits, clock: str, run: str = "", braked_ns: int = 0) -> None:
        self.limits = limits
        self._brake_ns = max(0, int(limits.brake_s * NS_PER_S) - braked_ns)
        self.table = failsafes(limits)
        self._acting = tuple(row for row in self.table if row.reaction is not Reaction.REFUSE)
        self.mode = DriverMode.CONNECTING
        self.reason = "waiting for the vehicle's first word"
        self.failsafe = ""
        self.gate = SetpointGate(int(limits.hover_after_s * NS_PER_S), clock)
        self.lease = LeaseBook(clock, run)
        self.vehicle = VehicleView()
        self.upstream = Upstream()
        self.evidence = Evidence(self.table)
        self._acks = AckBook()
        self._entered_ns = 0
        self._last_step_ns: int | None = None
        self._take_off_ended_ns = 0
        self._brake_until_ns = self._land_until_ns = 0
        self._clearing = False
        self._way_back = WayBack()
        self._passing: Failsafe | None = None
        self._entered_m, self._piloted_ns = 0.0, 0

    # -- inputs -------------------------------------------------------------------------------------------------------

    def accept_setpoint(self, now_ns: int, setpoint: VelocitySetpoint) -> str:
        """Take a setpoint; returns "" or a countable reason why it is ignored."""
        return self.gate.accept(now_ns, setpoint)

    def accept_lease(self, now_ns: int, lease: Lease) -> str:
        """Take a lease; returns "" or why it is ignored."""
        return self.lease.accept(now_ns, lease)

    def see(self, vehicle: VehicleView, upstream: Upstream) -> None:
        """Keep the newest view of the vehicle, and of tracker and supervisor, by which commands are judged."""
        self.vehicle, self.upstream = vehicle, upstream

    def accept_command(self, now_ns: int, command: Command) -> tuple[Ack, ...]:
        """Obey or refuse a command; returns the answers to publish. A repeated id is answered, not obeyed, again."""
        received = Ack(command.id, command.verb, AckStage.RECEIVED)
        before = self._acks.answered(command)
        if before is not None:
            return received, before
        refusal = self.lease.refusal(now_ns, command)
        if command.verb.stops and not refusal:
            self.lease.hear_stop(now_ns, command)
        refusal = refusal or self._obey(now_ns, command)
        return received, self._acks.answer(command, refusal, final=refusal == _CLEARED)

    def has_answered(self, command: Command) -> bool:
        """Return whether this is the repetition of a command that was obeyed or refused before."""
        return self._acks.answered(command) is not None

    def _obey(self, now_ns: int, command: Command) -> str:
        match command.verb:
            case Verb.CUT_MOTORS:
                return self._enter(now_ns, DriverMode.CUT, f"motors cut by {command.issuer}")
            case Verb.LAND:
                return self._obey_land(now_ns, command)
            case Verb.HOLD:
                return self._obey_hold(now_ns, command)
            case Verb.TAKEOFF:
                return self._obey_take_off(now_ns, command)
            case Verb.TRACK | Verb.RESUME:
                return self._obey_track(now_ns, command)

    def _obey_land(self, now_ns: int, command: Command) -> str:
        uncut = self.mode is DriverMode.CUT
        refusal = self._why_no_land_in_cut(now_ns) if uncut else ""
        if refusal:
            return refusal
        if uncut or self.mode in ALOFT or (self.mode is DriverMode.LANDING and self.failsafe):
            return self._enter(now_ns, DriverMode.LANDING, f"landing for {command.issuer}")
        self._brake_until_ns, self._land_until_ns = 0, now_ns + _TELLS_NS
        return ""

    def _why_no_land_in_cut(self, now_ns: int) -> str:
        if not self.vehicle.fresh or self.vehicle.flight_state not in AIRBORNE:
            return "motors are cut"
        return "motors are being cut" if now_ns - self._entered_ns < _TELLS_NS else ""

    def _obey_hold(self, now_ns: int, command: Command) -> str:
        stands = self.vehicle.fresh and self.vehicle.flight_state in STANDING
        if self.mode is DriverMode.TAKING_OFF and stands:
            return self._enter(now_ns, DriverMode.LANDED, f"take-off cancelled by {command.issuer}")
        if self.mode in ALOFT:
            return self._enter(now_ns, DriverMode.HOLD, f"held by {command.issuer}")
        return f"{self.mode} goes before HOLD" if self.mode in (DriverMode.LANDING, DriverMode.CUT) else ""

    def _obey_take_off(self, now_ns: int, command: Command) -> str:
        if self.mode not in (DriverMode.LANDED, DriverMode.CUT):
            return "the vehicle was not heard yet" if self.mode is DriverMode.CONNECTING else f"already {self.mode}"
        refusal = self._refusal(now_ns)
        if refusal:
            return refusal
        if self.vehicle.clears and self.vehicle.flight_state is FlightState.EMERGENCY:
            return self._clear(now_ns, command)
        self._clearing = self.vehicle.flight_state is FlightState.EMERGENCY
        self.gate.forget_epoch()
        self.evidence.forget()
        return self._enter(now_ns, DriverMode.TAKING_OFF, f"taking off for {command.issuer}")

    def _clear(self, now_ns: int, command: Command) -> str:
        self._enter(now_ns, DriverMode.LANDED, f"emergency cleared for {command.issuer}")
        self._clearing = True
        return _CLEARED

    def _refusal(self, now_ns: int, *conditions: Condition) -> str:
        """Return why the table refuses a start now, or ""; conditions: those to check, if not all."""
        holding = observed(self._situation(now_ns), self.limits)
        for row in self.table:
            counts = not conditions or row.condition in conditions
            if row.reaction is Reaction.REFUSE and counts and row.condition in holding:
                return row.text.format(why=holding[row.condition])
        return ""

    def _obey_track(self, now_ns: int, command: Command) -> str:
        if self.mode not in FREE:
            return f"the vehicle is {self.mode}"
        ended = self._refusal(now_ns, Condition.TELEMETRY_SILENT) or self.vehicle.flight_ends
        if ended:
            return ended
        above = (Condition.STOP_REQUESTED, Condition.SUPERVISOR_DEAD, Condition.SUPERVISOR_SILENT)
        refusal = self._refusal(now_ns, *above)
        if refusal:
            return refusal
        if self.gate.foreign:
            if command.verb is not Verb.RESUME:
                return "the tracker was restarted: RESUME is needed"
            if not self.gate.adopt(now_ns):
                return "the restarted tracker has no converged belief of this drone yet"
        self.evidence.pardon()
        return self._enter(now_ns, DriverMode.TRACK, f"tracking for {command.issuer}")

    def _enter(self, now_ns: int, mode: DriverMode, reason: str, row: Failsafe | None = None) -> str:
        if self.mode is DriverMode.TAKING_OFF:
            self._take_off_ended_ns = now_ns
        if mode is DriverMode.LANDING or (mode is DriverMode.LANDED and self.mode in FREE):
            self._land_until_ns = now_ns + _TELLS_NS
        self._entered_ns, self._entered_m = now_ns, self.vehicle.height_m
        self.mode, self.reason, self.failsafe = mode, reason, "" if row is None else row.condition
        self.evidence.enter(self._situation(now_ns), row, self.limits)
        self._brake_until_ns = now_ns + self._brake_ns if row is not None and row.brake else 0
        self._acks.enter(mode)
        return ""

    # -- outlook ------------------------------------------------------------------------------------------------------

    @property
    def braked(self) -> bool:
        """Return whether a row of the table makes it hover within TRACK for now."""
        return self._passing is not None and self._passing.reaction is Reaction.HOVER

    @property
    def told(self) -> str:
        """Return the condition of the row that only tells something now, or ""."""
        return self._passing.condition if self._passing is not None and not self.braked else ""

    @property
    def explanation(self) -> str:
        """Return why the vehicle acts as it does, in words; if it will land for another reason, that one."""
        if self._passing is not None:
            return f"{'hovers: ' if self.braked else ''}{self._text_of(self._passing)}"
        if self._landing is None:
            return self.reason
        text = self._text_of(self._landing.row)
        return text.removesuffix(UNRESUMED) + RESUME_NEEDED if text.endswith(UNRESUMED) else text

    @property
    def lands_in_s(self) -> float | None:
        """Return when the table lands the vehicle if nothing changes [s]; None while no such condition lasts."""
        return None if self._landing is None else self._landing.in_s

    @property
    def _landing(self) -> Outlook | None:
        return self.evidence.soonest(self.mode, Reaction.LAND)

    # -- step ---------------------------------------------------------------------------------------------------------

    def step(self, now_ns: int, vehicle: VehicleView, upstream: Upstream) -> WatchdogDecision:
        """Return the present decision; call it at the sender's rate."""
        self.see(vehicle, upstream)
        gap_s = 0.0 if self._last_step_ns is None else (now_ns - self._last_step_ns) / NS_PER_S
        self._last_step_ns = now_ns
        self._follow_vehicle(now_ns)
        if self.mode is DriverMode.LANDING and vehicle.piloted:
            self._piloted_ns, self._entered_m = now_ns, vehicle.height_m
        self.evidence.step(self._situation(now_ns, gap_s), self.limits)
        self._passing = self._heed_table(now_ns)
        obeyed = self.gate.obeyed(now_ns)
        setpoint = obeyed if self.mode is DriverMode.TRACK and self._passing is None else None
        acks = self._acks.effective(self.mode, self.vehicle, setpoint is not None)
        back = self._way_back.step(now_ns, self._asked_back(obeyed))
        if setpoint is None:
            action, at_ns = self._action(now_ns), self._entered_ns
            return WatchdogDecision(self.mode, action, reason=self.reason, acks=acks, entered_ns=at_ns, back_m_s=back)
        velocity, turn, ns = setpoint.velocity_m_s, setpoint.yaw_rate_rad_s, setpoint.header.stamp_ns
        return WatchdogDecision(self.mode, Action.FLY, velocity, turn, self.reason, acks, ns, None, self._entered_ns)

    def _asked_back(self, setpoint: VelocitySetpoint | None) -> Vector3 | None:
        """Return the velocity back to the place where it was commanded to hover; None if a failsafe might stop it."""
        waits = self.mode in (DriverMode.HOVER, DriverMode.HOLD) and self.failsafe in KEPT_IN_PLACE
        if setpoint is None or not setpoint.holds or not waits or self.vehicle.flight_state not in UP:
            return None
        return None if self.evidence.forbids_way_back else setpoint.velocity_m_s

    def _situation(self, now_ns: int, gap_s: float = 0.0) -> Situation:
        return Situation(
            now_ns, self.mode, self.reason, self.vehicle, self.upstream, self.gate, self._entered_ns,
            self._take_off_ended_ns, self._clears_in_time(now_ns), gap_s, self._entered_m, self._piloted_ns,
        )  # fmt: skip

    def _clears_in_time(self, now_ns: int) -> bool:
        return self._clearing and now_ns - self._entered_ns < self.limits.clear_s * NS_PER_S

    def _follow_vehicle(self, now_ns: int) -> None:
        """Enter the modes that the vehicle itself reaches."""
        state = self.vehicle.flight_state
        self._clearing = self._clearing and state is FlightState.EMERGENCY
        if not self.vehicle.fresh or state in UNHEARD:
            return
        if self.mode is DriverMode.CONNECTING and state not in AIRBORNE:
            self._enter(now_ns, DriverMode.LANDED, "connected")
        elif state is FlightState.LANDED and self.mode in FREE | {DriverMode.LANDING}:
            self._enter(now_ns, DriverMode.LANDED, f"landed ({self.reason})")
        elif self.vehicle.fell and self.mode in (DriverMode.LANDING, DriverMode.LANDED):
            self.reason = self.vehicle.fell  # no landing, whatever it said of it on its way
        elif state in UP and self.mode is DriverMode.TAKING_OFF:
            self._enter(now_ns, DriverMode.HOVER, "hovers after its take-off, waiting for TRACK")

    def _heed_table(self, now_ns: int) -> Failsafe | None:
        """React by the first row of the table that applies; returns it if it only brakes or tells, within the mode."""
        evidence = self.evidence
        for row in self._acting:
            if row.condition not in evidence.holding or not row.applies(self.mode, evidence.against_s(row)):
                continue
            if row.latch is Latch.NONE:
                return row
            self._react(now_ns, row, self._text_of(row))
            return None
        return None

    def _text_of(self, row: Failsafe) -> str:
        return row.text.format(why=self.evidence.holding.get(row.condition, ""))

    def _react(self, now_ns: int, row: Failsafe, reason: str) -> None:
        needed = RESUME_NEEDED if row.latch is Latch.RESUME else ""
        self._enter(now_ns, _ENTERED[row.reaction], reason + needed, row)

    def _action(self, now_ns: int) -> Action:
        match self.mode:
            case DriverMode.CONNECTING:  # a silent vehicle may still receive commands
                return Action.LAND if now_ns < self._land_until_ns else Action.WAIT
            case DriverMode.LANDED:
                if self.vehicle.clears and self._clears_in_time(now_ns):
                    return Action.CLEAR
                return Action.LAND if now_ns < self._land_until_ns else Action.IDLE
            case DriverMode.TAKING_OFF:
                return Action.TAKE_OFF
            case DriverMode.LANDING:
                return Action.HOVER if now_ns < self._brake_until_ns else Action.LAND
            case DriverMode.CUT:
                return Action.CUT
            case _:
                return Action.HOVER

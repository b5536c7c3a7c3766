"""Who may move a vehicle, and what it is to do now: one state machine for all kinds of vehicles.

Pure: `now_ns` and inputs in, a decision out. Priority: CUT_MOTORS > LAND > HOLD > setpoint > TAKEOFF. LAND latches
until a new TAKEOFF. Silence of the tracker, the vehicle or the supervisor stops, then lands.
Tables: docs/explanation/authority.md#the-watchdog.
"""

from drivers.lease import LeaseBook
from drivers.setpoints import SetpointGate
from drivers.watchdog_types import (
    AIRBORNE,
    ALOFT,
    FREE,
    STANDING,
    UP,
    Ack,
    Action,
    AuthorityLimits,
    DriverMode,
    Upstream,
    VehicleView,
    WatchdogDecision,
)
from groundstation.bus.messages import AckStage, Command, FlightState, Lease, VelocitySetpoint, Verb
from groundstation.time_units import NS_PER_S

_REMEMBERED_COMMANDS = 256


class Watchdog:
    """Authority over one vehicle. Feed it with `accept_*`, then call `step` at the sender's rate.

    mode, reason: see `WatchdogDecision`. The vehicle's and upstream's last words are remembered between steps.
    """

    def __init__(self, limits: AuthorityLimits, clock: str) -> None:
        self.limits = limits
        self.mode = DriverMode.CONNECTING
        self.reason = "waiting for the vehicle's first word"
        self.gate = SetpointGate(int(limits.hover_after_s * NS_PER_S), clock)
        self.lease = LeaseBook(clock)
        self.vehicle = VehicleView()
        self.upstream = Upstream()
        self._since: dict[str, int] = {}
        self._entered_ns = 0
        self._last_step_ns: int | None = None
        self._take_off_ended_ns = 0
        self._brake_until_ns = 0
        self._clearing = False
        self._paused_ns: int | None = None
        self._answers: dict[str, Ack] = {}
        self._pending: Command | None = None

    # -- inputs -------------------------------------------------------------------------------------------------------

    def accept_setpoint(self, now_ns: int, setpoint: VelocitySetpoint) -> str:
        """Take a setpoint; returns "" or a countable reason why it is ignored."""
        return self.gate.accept(now_ns, setpoint)

    def accept_lease(self, now_ns: int, lease: Lease) -> str:
        """Take a lease; returns "" or why it is ignored."""
        return self.lease.accept(now_ns, lease)

    def see(self, vehicle: VehicleView, upstream: Upstream) -> None:
        """Remember the last word of the vehicle and of those above, by which commands are judged."""
        self.vehicle, self.upstream = vehicle, upstream

    def accept_command(self, now_ns: int, command: Command) -> tuple[Ack, ...]:
        """Obey or refuse a command; returns the answers to publish. A repeated id is answered, not obeyed, again."""
        received = Ack(command.id, command.verb, AckStage.RECEIVED)
        if command.id in self._answers:
            return received, self._answers[command.id]
        refusal = self.lease.refusal(now_ns, command) or self._obey(now_ns, command)
        stage = AckStage.REFUSED if refusal else AckStage.ACCEPTED
        answer = Ack(command.id, command.verb, stage, refusal)
        if len(self._answers) >= _REMEMBERED_COMMANDS:
            self._answers.pop(next(iter(self._answers)))
        self._answers[command.id] = answer
        if not refusal:
            self._pending = command
        return received, answer

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
        if self.mode in ALOFT:
            return self._enter(now_ns, DriverMode.LANDING, f"landing for {command.issuer}")
        return "motors are cut" if self.mode is DriverMode.CUT else self._end_braking()

    def _end_braking(self) -> str:
        self._brake_until_ns = 0
        return ""

    def _obey_hold(self, now_ns: int, command: Command) -> str:
        if self.mode is DriverMode.TAKING_OFF and self.vehicle.flight_state in STANDING:
            return self._enter(now_ns, DriverMode.LANDED, f"take-off cancelled by {command.issuer}")
        if self.mode in ALOFT:
            return self._enter(now_ns, DriverMode.HOLD, f"held by {command.issuer}")
        return f"{self.mode} goes before HOLD" if self.mode in (DriverMode.LANDING, DriverMode.CUT) else ""

    def _obey_take_off(self, now_ns: int, command: Command) -> str:
        refusal = self._take_off_refusal()
        if refusal:
            return refusal
        self._clearing = self.vehicle.flight_state is FlightState.EMERGENCY
        self.gate.forget_epoch()
        self._since.clear()
        return self._enter(now_ns, DriverMode.TAKING_OFF, f"taking off for {command.issuer}")

    def _take_off_refusal(self) -> str:
        battery = self.vehicle.battery
        if self.mode not in (DriverMode.LANDED, DriverMode.CUT):
            return "the vehicle was not heard yet" if self.mode is DriverMode.CONNECTING else f"already {self.mode}"
        if not self.vehicle.fresh:
            return self.vehicle.silence
        if self.vehicle.flight_state not in STANDING:
            return f"the vehicle says {self.vehicle.flight_state}"
        if battery is None or battery < self.limits.battery_min:
            known = "unknown" if battery is None else f"{battery:.0%}"
            return f"battery {known}, at least {self.limits.battery_min:.0%} needed"
        return self._upstream_refusal() or self.vehicle.not_ready

    def _upstream_refusal(self) -> str:
        if self.upstream.stop_requested or not self.upstream.supervisor_alive:
            return "the ground station is stopping"
        return "" if self.upstream.supervisor_fresh else "the supervisor does not answer"

    def _obey_track(self, now_ns: int, command: Command) -> str:
        if self.mode not in FREE:
            return f"the vehicle is {self.mode}"
        if not self.vehicle.fresh:
            return self.vehicle.silence
        if self.vehicle.flight_state in STANDING | {FlightState.LANDING}:
            return f"the vehicle says {self.vehicle.flight_state}"
        refusal = self._upstream_refusal()
        if refusal:
            return refusal
        if self.gate.foreign:
            if command.verb is not Verb.RESUME:
                return "the tracker was restarted: RESUME is needed"
            if not self.gate.adopt(now_ns):
                return "the restarted tracker has no converged belief of this drone yet"
        return self._enter(now_ns, DriverMode.TRACK, f"tracking for {command.issuer}")

    def _enter(self, now_ns: int, mode: DriverMode, reason: str, brake: bool = False) -> str:
        if self.mode is DriverMode.TAKING_OFF:
            self._take_off_ended_ns = now_ns
        self._entered_ns = now_ns
        self.mode, self.reason = mode, reason
        self._paused_ns = None
        self._brake_until_ns = now_ns + int(self.limits.brake_s * NS_PER_S) if brake else 0
        if mode not in ALOFT and self._pending is not None and self._pending.verb not in (Verb.LAND, Verb.CUT_MOTORS):
            self._pending = None  # cannot become effective any more
        return ""

    # -- step ---------------------------------------------------------------------------------------------------------

    def step(self, now_ns: int, vehicle: VehicleView, upstream: Upstream) -> WatchdogDecision:
        """Return what to do now; call it at the sender's rate, 30 Hz."""
        self.see(vehicle, upstream)
        gap_s = 0.0 if self._last_step_ns is None else (now_ns - self._last_step_ns) / NS_PER_S
        self._last_step_ns = now_ns
        self._follow_vehicle(now_ns)
        if self.mode in ALOFT:
            self._heed_silence(now_ns, gap_s)
        setpoint = self._obeyed_setpoint(now_ns)
        acks = self._effective_ack(now_ns)
        if setpoint is None:
            return WatchdogDecision(self.mode, self._action(now_ns), reason=self.reason, acks=acks)
        velocity, turn, stamp_ns = setpoint.velocity_m_s, setpoint.yaw_rate_rad_s, setpoint.header.stamp_ns
        return WatchdogDecision(self.mode, Action.FLY, velocity, turn, self.reason, acks, stamp_ns)

    def _follow_vehicle(self, now_ns: int) -> None:
        state = self.vehicle.flight_state
        self._clearing = self._clearing and state is FlightState.EMERGENCY
        if not self.vehicle.fresh or state in (FlightState.UNKNOWN, FlightState.LOST):
            return
        if self.mode is DriverMode.CONNECTING:
            self._meet_vehicle(now_ns)
        elif state is FlightState.EMERGENCY:
            cleared_in_time = now_ns - self._entered_ns < self.limits.clear_s * NS_PER_S
            if self.mode in ALOFT | {DriverMode.LANDING} and not (self._clearing and cleared_in_time):
                self._enter(now_ns, DriverMode.CUT, "the vehicle reports an emergency")
        elif state is FlightState.LANDED:
            if self.mode in FREE | {DriverMode.LANDING}:
                self._enter(now_ns, DriverMode.LANDED, f"landed ({self.reason})")
        elif self.mode is DriverMode.LANDED:
            self._enter(now_ns, DriverMode.LANDING, f"airborne without a standing take-off order ({self.reason})")
        elif state is FlightState.LANDING and self.mode in ALOFT:
            self._enter(now_ns, DriverMode.LANDING, "the vehicle lands by itself")
        elif state in UP and self.mode is DriverMode.TAKING_OFF:
            self._enter(now_ns, DriverMode.HOVER, "airborne, waiting for TRACK")

    def _meet_vehicle(self, now_ns: int) -> None:
        # A restarted driver: what flies is stopped and landed, what stands never takes off by itself.
        if self.vehicle.flight_state in AIRBORNE:
            self._enter(now_ns, DriverMode.LANDING, "it was flying when this driver started", brake=True)
        else:
            self._enter(now_ns, DriverMode.LANDED, "connected")

    def _heed_silence(self, now_ns: int, gap_s: float) -> None:
        limits, up, vehicle = self.limits, self.upstream, self.vehicle
        dead_s = self._lasted("dead", not up.supervisor_alive, now_ns)
        frozen_s = self._lasted("frozen", not up.supervisor_fresh, now_ns)
        lost_s = self._lasted("lost", not vehicle.fresh, now_ns)
        # Who is noticed to be silent has been silent for hover_after_s already.
        noticed_s = limits.land_after_s - limits.hover_after_s
        low = vehicle.battery is not None and vehicle.battery < limits.battery_min
        low_s = self._lasted("battery", low, now_ns)
        landings = (
            (up.stop_requested, "the driver was told to stop"),
            (dead_s >= limits.brake_s, "the supervisor is dead"),
            (frozen_s >= noticed_s, "the supervisor does not answer"),
            (lost_s >= noticed_s, vehicle.silence),
            (low and low_s >= limits.battery_hold_s, "battery below its limit"),
            (self._take_off_overdue(now_ns), "take-off took too long"),
            (self._tracker_silent(now_ns), "no setpoint from the tracker"),
            (self._pause_overdue(now_ns), "the tracker paused, and nobody ordered RESUME"),
        )
        for applies, reason in landings:
            if applies:
                self._enter(now_ns, DriverMode.LANDING, reason)
                return
        heard_ns, paused = self.gate.last_heard_ns, self._tracker_paused(now_ns)
        suspensions = (
            (gap_s > limits.gap_s, f"this driver stood still for {gap_s:.1f} s"),
            (not up.supervisor_alive, "the supervisor is dead"),
            (frozen_s >= limits.resume_within_s, "the supervisor does not answer"),
            (lost_s >= limits.resume_within_s, vehicle.silence),
            (paused, "no setpoint from the tracker"),
        )
        for applies, reason in suspensions:
            if applies and self.mode is DriverMode.TRACK:
                self._enter(now_ns, DriverMode.HOVER, f"{reason}; RESUME is needed")
                self._paused_ns = heard_ns if paused else None

    def _lasted(self, what: str, condition: bool, now_ns: int) -> float:
        # Seconds for which a condition has held without a break.
        since_ns = self._since.setdefault(what, now_ns) if condition else self._since.pop(what, now_ns)
        return (now_ns - since_ns) / NS_PER_S if condition else 0.0

    def _take_off_overdue(self, now_ns: int) -> bool:
        return self.mode is DriverMode.TAKING_OFF and now_ns - self._entered_ns > self.limits.take_off_s * NS_PER_S

    def _tracker_silent(self, now_ns: int) -> bool:
        if self.mode is DriverMode.TAKING_OFF:
            return False
        heard_ns = self.gate.last_heard_ns
        unseen_until_ns = self._take_off_ended_ns + int(self.limits.unseen_land_after_s * NS_PER_S)
        if heard_ns is None:
            return now_ns >= unseen_until_ns
        return now_ns - heard_ns >= self.limits.land_after_s * NS_PER_S

    def _pause_overdue(self, now_ns: int) -> bool:
        # Setpoints that come back after a pause do not stop the land timer: only an order does.
        return self._paused_ns is not None and now_ns - self._paused_ns >= self.limits.land_after_s * NS_PER_S

    def _tracker_paused(self, now_ns: int) -> bool:
        heard_ns = self.gate.last_heard_ns
        if heard_ns is None:
            return False
        # Whoever orders TRACK before the tracker speaks again means it: the pause counts from that order.
        silent_ns = now_ns - max(heard_ns, self._entered_ns)
        return silent_ns >= self.limits.tracker_resume_within_s * NS_PER_S

    def _obeyed_setpoint(self, now_ns: int) -> VelocitySetpoint | None:
        heard = self.vehicle.fresh and self.upstream.supervisor_fresh and self.upstream.supervisor_alive
        return self.gate.obeyed(now_ns) if self.mode is DriverMode.TRACK and heard else None

    def _action(self, now_ns: int) -> Action:
        match self.mode:
            case DriverMode.CONNECTING:
                return Action.WAIT
            case DriverMode.LANDED:
                return Action.IDLE
            case DriverMode.TAKING_OFF:
                return Action.TAKE_OFF
            case DriverMode.LANDING:
                return Action.HOVER if now_ns < self._brake_until_ns else Action.LAND
            case DriverMode.CUT:
                return Action.CUT
            case _:
                return Action.HOVER

    # -- acknowledgement ----------------------------------------------------------------------------------------------

    def _effective_ack(self, now_ns: int) -> tuple[Ack, ...]:
        if self._pending is None or not self._is_effective(self._pending.verb, now_ns):
            return ()
        ack = Ack(self._pending.id, self._pending.verb, AckStage.EFFECTIVE)
        self._pending = None
        self._answers[ack.command_id] = ack
        return (ack,)

    def _is_effective(self, verb: Verb, now_ns: int) -> bool:
        # Seen on the vehicle, not merely sent.
        state = self.vehicle.flight_state if self.vehicle.fresh else FlightState.UNKNOWN
        match verb:
            case Verb.TAKEOFF:
                return self.mode in FREE and state in UP
            case Verb.TRACK | Verb.RESUME:
                return self._obeyed_setpoint(now_ns) is not None
            case Verb.HOLD:
                still = (FlightState.HOVERING, FlightState.LANDED)
                return self.mode in (DriverMode.HOLD, DriverMode.LANDED) and state in still
            case Verb.LAND:
                return state is FlightState.LANDED
            case Verb.CUT_MOTORS:
                return state in (FlightState.EMERGENCY, FlightState.LANDED)

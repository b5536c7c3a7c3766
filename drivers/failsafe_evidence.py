"""Evidence for the failsafe table: which conditions hold now, for how long, and why. Pure."""

from dataclasses import dataclass
from typing import NamedTuple

from drivers.failsafe_table import RESUME_NEEDED, Condition, Failsafe, Latch, Reaction
from drivers.setpoints import SetpointGate
from drivers.telemetry_return import TelemetryReturn
from drivers.watchdog_types import DriverMode, Upstream, VehicleView, WatchdogLimits
from groundstation.bus.messages import AIRBORNE, STANDING, UNHEARD, UP, FlightState
from groundstation.time_units import NS_PER_S

# An older setpoint is not part of a continuous stream.
_STREAM_S = 0.15
# From then on an order gives a row with `anew` its whole time once more.
_BEGUN_S = 1.0
# The most credit that a condition has when it is met anew, however long ago the last check was.
_FIRST_S = 0.05
# A coming reaction is reported once its condition has lasted for _LASTING_S and it is due within _NEAR_S; after
# _FAULT_S it is reported however far off it is. Slow take-offs are usual, and only reported near the end.
_LASTING_S, _NEAR_S, _FAULT_S = 0.3, 3.0, 3.0
_USUAL = frozenset({Condition.TAKE_OFF_OVERDUE})
_PAUSES = frozenset({Condition.TRACKER_RESTARTED, Condition.TRACKER_PAUSED, Condition.SETPOINTS_PATCHY})


class Situation(NamedTuple):
    """The watchdog's inputs at one moment; times in ns, gap_s: time for which the driver's own loop stood still.

    clearing: a take-off is clearing an emergency, within its time. entered_m: height at which it entered the mode, or
    at which a pilot let go of a landing, at piloted_ns.
    """

    now_ns: int
    mode: DriverMode
    reason: str
    vehicle: VehicleView
    upstream: Upstream
    gate: SetpointGate
    entered_ns: int = 0
    take_off_ended_ns: int = 0
    clearing: bool = False
    gap_s: float = 0.0
    entered_m: float = 0.0
    piloted_ns: int = 0

    def since_s(self, then_ns: int) -> float:
        """Return how long ago a moment was [s]."""
        return (self.now_ns - then_ns) / NS_PER_S

    @property
    def hears_flight(self) -> bool:
        """Return whether the vehicle is heard to fly; one whose sensors are wrong is heard all the same."""
        return bool(self.vehicle.fresh or self.vehicle.unsound) and self.vehicle.flight_state in AIRBORNE


def observed(at: Situation, limits: WatchdogLimits) -> dict[Condition, str]:
    """Return the conditions that hold at this moment, each with its explanation."""
    vehicle, up = at.vehicle, at.upstream
    holding: dict[Condition, str] = {}
    if up.stop_requested:
        holding[Condition.STOP_REQUESTED] = ""
    if not up.supervisor_alive:
        holding[Condition.SUPERVISOR_DEAD] = ""
    if not up.supervisor_fresh:
        holding[Condition.SUPERVISOR_SILENT] = ""
    if at.gap_s > limits.gap_s:
        holding[Condition.DRIVER_STOOD] = f"{at.gap_s:.1f} s"
    if vehicle.battery is None:
        holding[Condition.BATTERY_UNKNOWN] = f"{limits.battery_min:.0%}"
    elif vehicle.battery < limits.battery_min:
        holding[Condition.BATTERY_LOW] = f"{vehicle.battery:.0%}, at least {limits.battery_min:.0%}"
    if vehicle.not_ready:
        holding[Condition.NOT_READY] = vehicle.not_ready
    if vehicle.refuses:
        holding[Condition.TAKE_OFF_REFUSED] = vehicle.refuses
    if vehicle.near:
        holding[Condition.SOMEBODY_NEAR] = vehicle.near
    _observe_state(at, holding)
    _observe_setpoints(at, holding)
    _observe_motion(vehicle, limits, holding)
    if at.mode is DriverMode.LANDING and not vehicle.piloted:
        if vehicle.away:
            holding[Condition.FLIES_AWAY] = vehicle.away
        if vehicle.on_floor and at.hears_flight:
            holding[Condition.STANDS_RUNNING] = ""
    return holding


def _observe_state(at: Situation, holding: dict[Condition, str]) -> None:
    """Note conditions of the vehicle's report, and of its actions against its commands."""
    vehicle, state = at.vehicle, at.vehicle.flight_state
    if state in UNHEARD:
        holding[Condition.STATE_UNKNOWN] = ""
    if state not in STANDING:
        holding[Condition.NOT_STANDING] = str(state)
    if vehicle.unsound and not vehicle.seen:
        holding[Condition.BLIND] = vehicle.silence
    if not vehicle.fresh:
        holding[Condition.TELEMETRY_SILENT] = vehicle.silence
        if vehicle.unsound or vehicle.mute:
            holding[Condition.SENSORS_WRONG] = vehicle.silence
        return
    if state is FlightState.EMERGENCY and not at.clearing:
        holding[Condition.EMERGENCY] = ""
    if state is FlightState.LANDING:
        holding[Condition.LANDS_BY_ITSELF] = ""
    if vehicle.homeward:
        holding[Condition.FLIES_HOME] = vehicle.homeward
    if state in AIRBORNE and at.mode is DriverMode.CONNECTING:
        holding[Condition.FLEW_AT_START] = ""
    if state in AIRBORNE and at.mode is DriverMode.LANDED:
        holding[Condition.UNORDERED_FLIGHT] = at.reason
    # LANDING does not count: it is on its way down, and one that has fallen may say so for a while.
    if state in UP | {FlightState.TAKING_OFF} and at.mode is DriverMode.CUT:
        holding[Condition.CUT_IGNORED] = ""


def _observe_setpoints(at: Situation, holding: dict[Condition, str]) -> None:
    gate = at.gate
    if gate.last_heard_ns is not None and at.since_s(gate.last_heard_ns) > _STREAM_S:
        holding[Condition.SETPOINTS_PATCHY] = ""
    newest = gate.live(at.now_ns)
    if newest is None:
        holding[Condition.NO_SETPOINT] = ""
    elif not newest.converged:
        holding[Condition.UNCONVERGED] = ""


def _observe_motion(vehicle: VehicleView, limits: WatchdogLimits, holding: dict[Condition, str]) -> None:
    if vehicle.stray:
        holding[Condition.STRAYS] = vehicle.stray
    if vehicle.on_floor:
        holding[Condition.ON_FLOOR] = ""
    if vehicle.crowded:
        holding[Condition.CROWDED] = vehicle.crowded
    # Where a pilot's sticks take it is theirs to judge.
    if vehicle.outside and not vehicle.piloted:
        holding[Condition.FLOWN_OUTSIDE if vehicle.flown_by_others else Condition.OUTSIDE] = vehicle.outside
    if vehicle.speed_m_s > limits.tolerated_speed_m_s:
        allowed = f"{limits.max_speed_m_s:.1f} are allowed"
        condition = Condition.FLOWN_TOO_FAST if vehicle.foreign else Condition.TOO_FAST
        holding[condition] = f"it flies {vehicle.speed_m_s:.1f} m/s, {allowed}"
    elif vehicle.climb_m_s > limits.tolerated_climb_m_s and not vehicle.on_floor:
        # WIRE (ArduCopter 4.7, SITL): having fallen on the floor it reports a climb of 1 m/s for half a second.
        allowed = f"{limits.max_climb_m_s:.1f} are allowed"
        holding[Condition.FLOWN_TOO_FAST] = f"it climbs {vehicle.climb_m_s:.1f} m/s, {allowed}"


def timed(at: Situation, limits: WatchdogLimits) -> dict[Condition, float]:
    """Return the duration of a condition that has its own time of begin [s]."""
    if at.mode is DriverMode.TAKING_OFF:
        return {Condition.TAKE_OFF_OVERDUE: at.since_s(at.entered_ns)}
    if at.mode is DriverMode.LANDING and at.hears_flight and not at.vehicle.on_floor:
        since_s = at.since_s(max(at.entered_ns, at.piloted_ns))
        return {Condition.LANDING_OVERDUE: since_s - at.entered_m / limits.sinks_m_s}
    heard_ns, any_heard_ns = at.gate.last_heard_ns, at.gate.any_heard_ns
    if heard_ns is None or any_heard_ns is None:
        lasted = {Condition.UNSEEN: at.since_s(at.take_off_ended_ns)}
    else:
        # A TRACK command given while the tracker is silent is deliberate: the pause counts from that order.
        pause_s = at.since_s(max(heard_ns, at.entered_ns))
        lasted = {Condition.TRACKER_SILENT: at.since_s(any_heard_ns), Condition.TRACKER_PAUSED: pause_s}
        if at.gate.foreign and at.gate.live(at.now_ns) is not None:
            lasted[Condition.TRACKER_RESTARTED] = at.since_s(heard_ns)
    for condition, lasted_s in (
        (Condition.NOT_SEEN, at.vehicle.unseen_s),
        (Condition.UNLOCATED, at.vehicle.lost_s),
    ):
        if lasted_s > 0.0:
            lasted[condition] = lasted_s
    return lasted


def _why(condition: Condition, at: Situation) -> str:
    if condition is Condition.LEFT_WAITING:
        return at.reason.removesuffix(RESUME_NEEDED)
    if condition is Condition.TAKE_OFF_OVERDUE and at.vehicle.unarmed:
        return f": {at.vehicle.unarmed}"
    return at.vehicle.unlocated if condition is Condition.UNLOCATED else ""


@dataclass(frozen=True, slots=True)
class Outlook:
    """A row that will act, and in what time if nothing changes [s]."""

    row: Failsafe
    in_s: float


def _is_told(row: Failsafe, lasted_s: float) -> bool:
    """Return whether the coming reaction of a row is to be reported to the operator by now."""
    near = row.after_s - lasted_s <= _NEAR_S
    return lasted_s >= _LASTING_S and (near or (lasted_s >= _FAULT_S and row.condition not in _USUAL))


class Evidence:
    """Keeps the duration of each condition; when one ends, its duration decays by the rules of the table."""

    def __init__(self, table: tuple[Failsafe, ...]) -> None:
        self._table = table
        self._forgets = {row.condition: row.forgets for row in table if row.forgets is not None}
        self.holding: dict[Condition, str] = {}
        self.charged_s: dict[Condition, float] = {}
        self._pardoned_s: dict[Condition, float] = {}
        self._anew_s: dict[Condition, float] = {}
        self._last_ns: int | None = None
        self._waits: dict[Condition, int] = {}
        self._mode: DriverMode | None = None
        self._strayed_ns: int | None = None  # since the last order
        self._strayed_by = ""  # which velocity
        self._obeyed = False  # since then
        self._return = TelemetryReturn()

    def step(self, at: Situation, limits: WatchdogLimits) -> None:
        """Take the situation of one turn."""
        elapsed_s = 0.0 if self._last_ns is None else at.since_s(self._last_ns)
        self._last_ns = at.now_ns
        before, self.holding = self.holding, observed(at, limits)
        self._observe_return(at, limits)
        for condition in self.charged_s.keys() - self.holding.keys():
            left_s = self.charged_s[condition] - self._forgets.get(condition, float("inf")) * max(elapsed_s, 1e-9)
            self.charged_s[condition] = left_s
            if left_s <= 0.0:
                del self.charged_s[condition]
        for condition in self.holding:
            more_s = elapsed_s if condition in before else min(elapsed_s, _FIRST_S)
            self.charged_s[condition] = self.charged_s.get(condition, 0.0) + more_s
        # Conditions that end do not stop the timer of a wait for an order: only an order does.
        waits = {condition: at.since_s(since_ns) for condition, since_ns in self._waits.items()}
        for condition, lasted_s in (timed(at, limits) | waits).items():
            self.holding[condition], self.charged_s[condition] = _why(condition, at), lasted_s
        for since_s in (self._pardoned_s, self._anew_s):
            for condition in since_s:
                since_s[condition] = min(since_s[condition], self.charged_s.get(condition, 0.0))
        self._observe_silence(at, limits)

    def _observe_return(self, at: Situation, limits: WatchdogLimits) -> None:
        """Note that it strays once more soon after it began to; one push shows twice: by report, later by cameras."""
        stray, stray_by = self.holding.get(Condition.STRAYS), at.vehicle.stray_by
        if stray is None:
            self._obeyed = True
        elif self._strayed_ns is None or at.since_s(self._strayed_ns) >= limits.stray_again_s:
            self._strayed_ns, self._strayed_by, self._obeyed = at.now_ns, stray_by, False
        elif self._obeyed and stray_by == self._strayed_by:
            self.holding[Condition.STRAYS_AGAIN] = stray

    def _observe_silence(self, at: Situation, limits: WatchdogLimits) -> None:
        """Note what a silence of the telemetry leads to; if a part of it was wrong values, all of it counts as that."""
        silent, wrong = Condition.TELEMETRY_SILENT, Condition.SENSORS_WRONG
        charged_s = self.charged_s.get(silent, 0.0) - self._pardoned_s.get(silent, 0.0)
        if self._return.is_doubted(charged_s, at.vehicle) and silent in self.holding:
            self.holding.setdefault(wrong, self.holding[silent])
            as_wrong_s = charged_s + self._pardoned_s.get(wrong, 0.0)
            self.charged_s[wrong] = max(as_wrong_s, self.charged_s.get(wrong, 0.0))
        self.holding |= self._return.step(at.now_ns, charged_s, at.mode is DriverMode.TRACK, at.vehicle, limits)

    def against_s(self, row: Failsafe) -> float | None:
        """Return how long a row's condition has lasted [s]: since the last order that ends it, or begins it anew."""
        lasted_s, ends = self.lasted_s(row.condition), row.latch is Latch.RESUME
        since_s = self._pardoned_s if ends else self._anew_s if row.anew else {}
        return None if lasted_s is None else lasted_s - since_s.get(row.condition, 0.0)

    def lasted_s(self, condition: Condition) -> float | None:
        """Return for how long a condition has lasted [s], or None if it does not hold."""
        return self.charged_s.get(condition, 0.0) if condition in self.holding else None

    def enter(self, at: Situation, row: Failsafe | None, limits: WatchdogLimits) -> None:
        """Note the begin of a mode, and from when on it waits for RESUME if its row needs that; row: None for an order.

        A pause of the tracker counts from the last setpoint that was obeyed, and each new CUT has its own time.
        """
        if at.mode is not self._mode:
            self._mode = at.mode
            self.charged_s.pop(Condition.CUT_IGNORED, None)
        if row is None:
            self._strayed_ns = None
        self._waits = {}
        if row is None or row.latch is not Latch.RESUME:
            return
        paused_s = self.lasted_s(Condition.TRACKER_PAUSED) or 0.0
        heard_ns = at.gate.last_heard_ns
        paused = row.condition in _PAUSES or paused_s >= limits.tracker_resume_within_s
        if paused and heard_ns is not None:
            self._waits = {Condition.NOT_RESUMED: heard_ns}
        else:
            self._waits = {Condition.LEFT_WAITING: at.now_ns}

    @property
    def forbids_way_back(self) -> bool:
        """Return whether a tracking vehicle would have to hover, be it for anything but what the way back ends."""
        hovers = (row for row in self._table if row.reaction is Reaction.HOVER and row.condition != Condition.OUTSIDE)
        return any(row.applies(DriverMode.TRACK, self.against_s(row)) for row in hovers)

    def soonest(self, mode: DriverMode, reaction: Reaction) -> Outlook | None:
        """Return which row with a reaction acts first if nothing changes, and when; None: none is to be reported."""
        waits = [
            Outlook(row, max(0.0, row.after_s - lasted_s))
            for row in self._table
            if row.reaction is reaction and mode in row.modes
            and _is_told(row, lasted_s := self.against_s(row) or 0.0)
        ]  # fmt: skip
        return min(waits, key=lambda outlook: outlook.in_s, default=None)

    def forget(self) -> None:
        """Begin anew with all conditions, for a take-off."""
        self.charged_s.clear()
        self._pardoned_s.clear()
        self._anew_s.clear()
        self._return.forget()

    def pardon(self) -> None:
        """Begin anew for the rows that an order to go on ends; their conditions go on counting for all others.

        So do rows with `anew`: once, until their condition has worn off, and not for what has hardly begun.
        """
        self._pardoned_s = dict(self.charged_s)
        begun = ((condition, lasted_s) for condition, lasted_s in self.charged_s.items() if lasted_s >= _BEGUN_S)
        self._anew_s |= {condition: self._anew_s.get(condition) or lasted_s for condition, lasted_s in begun}
        self._return.forget()

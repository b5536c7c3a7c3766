"""The table of failsafes: everything that stops a vehicle, or keeps it from starting, as data.

Rows are ordered by priority: the first that applies acts. The documentation's table is generated from this one.
"""

from dataclasses import dataclass
from enum import StrEnum, auto
from functools import cache

from drivers.watchdog_types import ALOFT, FREE, DriverMode, WatchdogLimits


class Reaction(StrEnum):
    """The reaction of a row; TELL: nothing is left but to tell the operator; REFUSE: a TAKEOFF is not obeyed."""

    CUT = "CUT"
    LAND = "LAND"
    HOVER = "HOVER"
    TELL = "tell"
    REFUSE = "refuse take-off"


class Latch(StrEnum):
    """The end of a reaction."""

    TAKEOFF = "a new TAKEOFF"
    RESUME = "TRACK or RESUME"
    NONE = "the end of its condition"


class Condition(StrEnum):
    """A condition that can be wrong; its evidence: `failsafe_evidence.py`."""

    EMERGENCY = auto()
    FLEW_AT_START = auto()
    UNORDERED_FLIGHT = auto()
    CUT_IGNORED = auto()
    LANDS_BY_ITSELF = auto()
    FLIES_HOME = auto()
    STOP_REQUESTED = auto()
    SUPERVISOR_DEAD = auto()
    SUPERVISOR_SILENT = auto()
    BLIND = auto()
    TELEMETRY_SILENT = auto()
    SENSORS_WRONG = auto()
    TELEMETRY_BACK = auto()
    BACK_IN_DOUBT = auto()
    STATE_UNKNOWN = auto()
    NOT_STANDING = auto()
    BATTERY_LOW = auto()
    BATTERY_UNKNOWN = auto()
    TAKE_OFF_REFUSED = auto()
    TAKE_OFF_OVERDUE = auto()
    TRACKER_SILENT = auto()
    TRACKER_RESTARTED = auto()
    UNSEEN = auto()
    NOT_SEEN = auto()
    UNLOCATED = auto()
    TRACKER_PAUSED = auto()
    NOT_RESUMED = auto()
    LEFT_WAITING = auto()
    NO_SETPOINT = auto()
    SETPOINTS_PATCHY = auto()
    UNCONVERGED = auto()
    STRAYS = auto()
    STRAYS_AGAIN = auto()
    TOO_FAST = auto()
    FLOWN_TOO_FAST = auto()
    CROWDED = auto()
    OUTSIDE = auto()
    FLOWN_OUTSIDE = auto()
    ON_FLOOR = auto()
    FLIES_AWAY = auto()
    LANDING_OVERDUE = auto()
    STANDS_RUNNING = auto()
    DRIVER_STOOD = auto()
    NOT_READY = auto()
    SOMEBODY_NEAR = auto()


# Ends the reason for a hover that only an order ends; the monitor and the page read it.
RESUME_NEEDED = "; RESUME is needed"
# Ends the text of a row that lands because that order does not come.
UNRESUMED = ", and nobody ordered RESUME"
# Seconds by which a condition's duration decays for each second without it: failing one sixth of the time adds up.
SLOWLY = 0.2
EVENLY = 1.0
# When telemetry or the supervisor counts as silent, that has lasted for so long [s].
_NOTICED_S = 0.3


@dataclass(frozen=True, slots=True)
class Failsafe:
    """One row.

    after_s: how long the condition must have lasted (its debounce). forgets: seconds of decay per second without it
    (its hysteresis); None: all at once. modes: in which it counts. text: for the operator; `{why}` is filled in from
    the evidence. brake: hover first, because it is unknown what the vehicle was doing. limit: the setting that gives
    the time, of which after_s leaves out what has passed before the condition is noticed. anew: TRACK or
    RESUME begin its time anew, once until its condition has worn off.
    """

    condition: Condition
    reaction: Reaction
    text: str
    after_s: float = 0.0
    limit: str = ""
    forgets: float | None = None
    latch: Latch = Latch.TAKEOFF
    modes: frozenset[DriverMode] = ALOFT
    brake: bool = False
    anew: bool = False

    def applies(self, mode: DriverMode, lasted_s: float | None) -> bool:
        """Return whether it acts in a mode; lasted_s: how long its condition has lasted (None: it does not hold)."""
        return lasted_s is not None and mode in self.modes and lasted_s >= self.after_s


# A vehicle's action without another command.
_TRACK = frozenset({DriverMode.TRACK})
_HOVER = frozenset({DriverMode.HOVER})
_LANDS = frozenset({DriverMode.LANDING})
_STANDS = frozenset({DriverMode.LANDED, DriverMode.CUT})
_UNCONVERGED = "the tracker does not know well enough where it is"


@cache
def failsafes(limits: WatchdogLimits) -> tuple[Failsafe, ...]:
    """Return the table for a vehicle's limits, highest priority first."""
    return (
        *_ends(limits), *_landings(limits), *_suspensions(limits), *_brakes(limits), *_alerts(limits), *_refusals(),
    )  # fmt: skip


def _ends(limits: WatchdogLimits) -> tuple[Failsafe, ...]:
    emergency = ALOFT | {DriverMode.LANDING}
    return (
        Failsafe(Condition.EMERGENCY, Reaction.CUT, "the vehicle reports an emergency", modes=emergency),
        Failsafe(Condition.FLEW_AT_START, Reaction.LAND, "it was flying when this driver started", brake=True,
                 modes=frozenset({DriverMode.CONNECTING})),
        Failsafe(Condition.UNORDERED_FLIGHT, Reaction.LAND, "airborne without a standing take-off order ({why})",
                 modes=frozenset({DriverMode.LANDED})),
        # By then every kind of vehicle whose motors stopped has fallen, and says so.
        Failsafe(Condition.CUT_IGNORED, Reaction.LAND, "it flies although its motors were cut", limits.cut_s,
                 forgets=SLOWLY, modes=frozenset({DriverMode.CUT})),
        Failsafe(Condition.LANDS_BY_ITSELF, Reaction.LAND, "the vehicle lands by itself"),
        # A return begins with a climb, out of all views and to the ceiling.
        Failsafe(Condition.FLIES_HOME, Reaction.LAND, "it {why}"),
    )  # fmt: skip


def _landings(limits: WatchdogLimits) -> tuple[Failsafe, ...]:
    noticed_s = limits.land_after_s - _NOTICED_S
    land, patience = Reaction.LAND, "safety.land_after_s"
    return (
        Failsafe(Condition.STOP_REQUESTED, land, "the driver was ordered to stop"),
        Failsafe(Condition.SUPERVISOR_DEAD, land, "the supervisor is dead", limits.brake_s),
        Failsafe(Condition.SUPERVISOR_SILENT, land, "the supervisor does not answer", noticed_s, patience, SLOWLY),
        # Its own hover may rely on the faulty value, and cameras do not show how to brake it.
        Failsafe(Condition.BLIND, land, "{why}, and no camera sees it", limits.blind_land_s, "", SLOWLY, modes=FREE),
        # This covers frozen and stuck sensors: drivers/plausibility names them, and VehicleView.plausible makes them
        # silence.
        Failsafe(Condition.TELEMETRY_SILENT, land, "{why}", noticed_s, patience, SLOWLY),
        Failsafe(Condition.STATE_UNKNOWN, land, "the vehicle does not say what it does", noticed_s, patience, SLOWLY),
        Failsafe(Condition.BATTERY_LOW, land, "battery below its limit", limits.battery_hold_s,
                 "limits.battery_hold_s", SLOWLY),
        Failsafe(Condition.BATTERY_UNKNOWN, land, "its battery is unknown", limits.battery_hold_s,
                 "limits.battery_hold_s", SLOWLY),
        # Never repeated: a blocked propeller would be spun again and again.
        Failsafe(Condition.TAKE_OFF_REFUSED, land, "it refuses to take off: {why}",
                 modes=frozenset({DriverMode.TAKING_OFF})),
        Failsafe(Condition.TAKE_OFF_OVERDUE, land, "take-off took too long{why}", limits.take_off_s),
        Failsafe(Condition.TRACKER_SILENT, land, "the tracker sends it no velocity", limits.land_after_s, patience),
        Failsafe(Condition.UNSEEN, land, "the tracker sends it no velocity", limits.unseen_land_after_s,
                 "safety.unseen_land_after_s"),
        # On HOLD a restarted tracker is as good as any other: it moves nobody before RESUME.
        Failsafe(Condition.TRACKER_RESTARTED, land, f"the tracker restarted{UNRESUMED}", limits.land_after_s, patience,
                 modes=_HOVER | _TRACK),
        Failsafe(Condition.NOT_RESUMED, land, f"the tracker paused{UNRESUMED}", limits.land_after_s, patience),
        # Nobody hovers for ever: an operator who did not notice leaves it to its battery.
        Failsafe(Condition.LEFT_WAITING, land, f"{{why}}{UNRESUMED}", limits.unresumed_land_s,
                 modes=_HOVER),
        Failsafe(Condition.UNCONVERGED, land, _UNCONVERGED, limits.unseen_land_after_s,
                 "safety.unseen_land_after_s", EVENLY, modes=FREE),
        Failsafe(Condition.NOT_SEEN, land, "not seen by any camera for too long", limits.unseen_land_after_s,
                 "safety.unseen_land_after_s", modes=FREE),
        Failsafe(Condition.UNLOCATED, land, "no position {why}", limits.lost_land_s, modes=FREE),
        Failsafe(Condition.STRAYS, land, "it does not do what it is told: {why}", limits.stray_land_s, modes=FREE),
        # Swinging to and fro, it obeys for a moment at each end.
        Failsafe(Condition.STRAYS_AGAIN, land, "it does not do what it is told, again: {why}",
                 modes=_HOVER | {DriverMode.HOLD}),
        Failsafe(Condition.TOO_FAST, land, "{why}", limits.fast_land_s, "", SLOWLY, modes=FREE),
        # No order of ours but LAND brakes it, and that late: PX4 goes on for 7 m from 2.3 m/s.
        Failsafe(Condition.FLOWN_TOO_FAST, land, "{why}, not by our orders", limits.fast_brake_s, "", SLOWLY,
                 modes=FREE),
        # Hovering and tracking drones are moved apart: this is for when that fails.
        Failsafe(Condition.CROWDED, land, "{why}", limits.crowded_land_s, "", SLOWLY, modes=FREE),
        # Nobody stays outside, be it in a hover that nothing ends; one that is on its way back is not counted, and one
        # told to go on has the time to begin.
        Failsafe(Condition.OUTSIDE, land, "{why}", limits.land_after_s, patience, SLOWLY, anew=True),
        # Others obey no limiter of ours; no order but LAND stops what they fly.
        Failsafe(Condition.FLOWN_OUTSIDE, land, "{why}, not by our orders", limits.flown_outside_s, "", SLOWLY),
        # A pilot has landed it, or it was pressed down: its controllers wind up until it notices that it has landed.
        Failsafe(Condition.ON_FLOOR, land, "it has come down to the floor", limits.floor_land_s, modes=FREE),
    )  # fmt: skip


def _suspensions(limits: WatchdogLimits) -> tuple[Failsafe, ...]:
    rows = (
        (Condition.DRIVER_STOOD, "this driver stood still for {why}", 0.0, None),
        (Condition.SUPERVISOR_DEAD, "the supervisor is dead", 0.0, None),
        (Condition.SUPERVISOR_SILENT, "the supervisor does not answer", limits.resume_within_s, SLOWLY),
        # A radio that paused says nothing against vehicle, tracker or supervisor: see TELEMETRY_BACK.
        (Condition.SENSORS_WRONG, "{why}", limits.resume_within_s, SLOWLY),
        (Condition.BACK_IN_DOUBT, "its telemetry is back, but {why}", 0.0, None),
        (Condition.STATE_UNKNOWN, "the vehicle does not say what it does", _NOTICED_S, SLOWLY),
        (Condition.TRACKER_RESTARTED, "the tracker restarted", 0.0, None),
        (Condition.TRACKER_PAUSED, "the tracker sends it no velocity", limits.tracker_resume_within_s, None),
        (Condition.SETPOINTS_PATCHY, "the tracker's velocities come in bits only", limits.resume_within_s, SLOWLY),
        (Condition.STRAYS, "it does not do what it is told: {why}", 0.0, None),
        (Condition.TOO_FAST, "{why}", limits.fast_resume_s, SLOWLY),
        (Condition.OUTSIDE, "{why}", limits.outside_hover_s, SLOWLY),
    )
    return tuple(
        Failsafe(condition, Reaction.HOVER, text, after_s, "", forgets, Latch.RESUME, _TRACK)
        for condition, text, after_s, forgets in rows
    )


def _brakes(limits: WatchdogLimits) -> tuple[Failsafe, ...]:
    rows = (
        (Condition.SUPERVISOR_SILENT, "the supervisor does not answer", 0.0),
        (Condition.TELEMETRY_SILENT, "{why}", 0.0),
        (Condition.TELEMETRY_BACK, "its telemetry is back, and has to last for {why}", 0.0),
        (Condition.NO_SETPOINT, "the tracker sends it no velocity", 0.0),
        (Condition.UNCONVERGED, _UNCONVERGED, 0.0),
        (Condition.UNLOCATED, "no position {why}", limits.lost_hover_s),
        (Condition.TOO_FAST, "{why}", limits.fast_brake_s),
    )
    return tuple(
        Failsafe(condition, Reaction.HOVER, text, after_s, latch=Latch.NONE, modes=_TRACK)
        for condition, text, after_s in rows
    )


def _alerts(limits: WatchdogLimits) -> tuple[Failsafe, ...]:
    aloft = "it does not come down"
    rows = (
        (Condition.STANDS_RUNNING, "it stands on the floor with running motors: CUT MOTORS stops them",
         limits.stands_told_s, EVENLY),
        (Condition.FLIES_AWAY, f"{aloft}: {{why}}", limits.away_told_s, EVENLY),
        (Condition.LANDING_OVERDUE, f"{aloft}: it should have landed by now", limits.landing_s, None),
    )  # fmt: skip
    return tuple(
        Failsafe(condition, Reaction.TELL, text, after_s, "", forgets, Latch.NONE, _LANDS)
        for condition, text, after_s, forgets in rows
    )


def _refusals() -> tuple[Failsafe, ...]:
    rows = (
        (Condition.TELEMETRY_SILENT, "{why}"),
        (Condition.NOT_STANDING, "the vehicle says {why}"),
        (Condition.BATTERY_UNKNOWN, "battery unknown, at least {why} needed"),
        (Condition.BATTERY_LOW, "battery {why} needed"),
        (Condition.STOP_REQUESTED, "the ground station is stopping"),
        (Condition.SUPERVISOR_DEAD, "the ground station is stopping"),
        (Condition.SUPERVISOR_SILENT, "the supervisor does not answer"),
        (Condition.NOT_READY, "{why}"),
        (Condition.SOMEBODY_NEAR, "{why}"),
    )
    return tuple(
        Failsafe(condition, Reaction.REFUSE, text, latch=Latch.NONE, modes=_STANDS) for condition, text in rows
    )

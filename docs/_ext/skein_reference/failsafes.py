"""Page of the table of failsafes, from the table itself."""

from drivers.failsafe_table import Condition, Failsafe, failsafes
from drivers.watchdog_types import WatchdogLimits
from skein_reference.markdown import code, page, prose, table

_INTRODUCTION = """\
Everything that stops a vehicle without an order, keeps it from starting, or is only reported, because the drone is
already landing and does not come down, or does not stop its motors there.
Of the rows that apply the first one acts;
an order of a person (CUT_MOTORS, LAND, HOLD) needs no row. Times are those of the default settings; where a setting
gives them it stands behind.

A condition that is over is forgotten at once, or by so many seconds for each second without it, so that conditions
which come and go add up. TRACK and RESUME reset those that need them."""

EVIDENCE: dict[Condition, str] = {
    Condition.EMERGENCY: "the vehicle says EMERGENCY, and no take-off is clearing one (2 s)",
    Condition.FLEW_AT_START: "the vehicle's first word is that it flies",
    Condition.UNORDERED_FLIGHT: "it says that it flies while it should stand",
    Condition.CUT_IGNORED: "it says that it flies, though not that it lands, while it is told to cut its motors",
    Condition.LANDS_BY_ITSELF: "it says LANDING without a LAND",
    Condition.FLIES_HOME: "MAVLink: its heartbeat says AUTO.RETURN (PX4), RTL, SMART_RTL or AUTO_RTL (ArduPilot)",
    Condition.STOP_REQUESTED: "SIGTERM to the driver",
    Condition.SUPERVISOR_DEAD: "the supervisor's process is gone",
    Condition.SUPERVISOR_SILENT: "no heartbeat of the supervisor for 0.3 s",
    Condition.BLIND: "a BAD sensor, the IMU excepted, while cameras do not show how fast it is",
    Condition.TELEMETRY_SILENT: "no telemetry for 0.3 s, or a BAD sensor",
    Condition.SENSORS_WRONG: "a BAD sensor, or telemetry without its motion; a silence with a BAD sensor in it "
    "counts in full",
    Condition.TELEMETRY_BACK: "telemetry has lasted for less than 1.5 s without a pause of 0.3 s, after a "
    "`telemetry_silent` of 1.0 s since the last order to go on; or for less than 0.8 s, after one of 0.5 s",
    Condition.BACK_IN_DOUBT: "likewise, after the fourth one of 1.0 s within 60 s, or for 10 s in all, no such order "
    "since; or in a mode that others chose meanwhile (MAVLink)",
    Condition.STATE_UNKNOWN: "its state is UNKNOWN or LOST",
    Condition.NOT_STANDING: "its state is neither LANDED nor EMERGENCY",
    Condition.BATTERY_LOW: "battery below `limits.battery_min`",
    Condition.BATTERY_UNKNOWN: "no charge told, or none for 10 s (MAVLink)",
    Condition.TAKE_OFF_REFUSED: "Tello: it answers `error` to `takeoff`",
    Condition.TAKE_OFF_OVERDUE: "it does not say that it flies; the text ends with a MAVLink vehicle's own reason",
    Condition.TRACKER_SILENT: "no setpoint",
    Condition.TRACKER_RESTARTED: "setpoints of a newer epoch than the authorised one; since the last of that one",
    Condition.UNSEEN: "no setpoint since take-off",
    Condition.NOT_SEEN: "the age of its own estimate, as the tracker says",
    Condition.UNLOCATED: "nothing sharp enough to feed to an autopilot that flies by our position (MAVLink)",
    Condition.TRACKER_PAUSED: "no setpoint of the authorised epoch",
    Condition.NOT_RESUMED: "a pause of the tracker, or patches, and no TRACK, RESUME or HOLD since",
    Condition.LEFT_WAITING: "another row made it hover until TRACK or RESUME, and no TRACK, RESUME or HOLD since",
    Condition.NO_SETPOINT: "the newest setpoint has expired (`safety.setpoint_lifetime_ms`)",
    Condition.SETPOINTS_PATCHY: "the newest setpoint is older than 0.15 s",
    Condition.UNCONVERGED: "setpoints that say so",
    Condition.STRAYS: "reported or estimated velocity against what was commanded; up and down only the estimated one",
    Condition.STRAYS_AGAIN: "likewise, by the same velocity, within 5 s of the first time since an order, and having "
    "obeyed in between",
    Condition.TOO_FAST: "reported or estimated speed above 1.3 `limits.max_speed_m_s` + 0.2 m/s",
    Condition.FLOWN_TOO_FAST: "likewise, or a climb above 1.3 `limits.max_climb_m_s` + 0.2 m/s, in a mode that is "
    "not ours, unless a pilot's sticks move it (MAVLink)",
    Condition.CROWDED: "the estimates of it and of another that flies and does not land are nearer to each other than "
    "`safety.min_separation_m`, by more than two standard deviations, and it is the lower one; of two as high as each "
    "other (0.2 m) the later one by name",
    Condition.OUTSIDE: "its estimated place is outside `room.fence` in the plane, or above it, by more than 0.1 m and "
    "two standard deviations, until it is back within 0.05 m; not while it comes back at 0.1 m/s or half of its limit, "
    "nor while a pilot's sticks may move it, nor by an estimate that sightings contradict or that is older than 0.3 s. "
    "RESUME or TRACK in the hover give it the time of the landing anew, once until it has worn off",
    Condition.FLOWN_OUTSIDE: "likewise, coming back or not, in a mode that is not ours (MAVLink); not while it ends "
    "its own climb, nor for 1.5 s after a pilot let go of it: that is `outside`",
    Condition.ON_FLOOR: "since its take-off it was higher, and now its estimated height, known to 0.2 m within two "
    "standard deviations, is 0.1 m or less",
    Condition.FLIES_AWAY: "by cameras it rises faster than 0.3 m/s, or is as fast as for `too_fast` and sinks by no "
    "more than 0.2 m/s",
    Condition.STANDS_RUNNING: "on the floor as for `on_floor`, and says that it flies",
    Condition.LANDING_OVERDUE: "it says that it flies; since its landing began, less the time for its height then at "
    "0.3 m/s, and not on the floor as for `on_floor`",
    Condition.DRIVER_STOOD: "more than 0.5 s between two turns of the driver",
    Condition.NOT_READY: "the driver's own reason",
    Condition.SOMEBODY_NEAR: "a vehicle in the air whose estimate, less two standard deviations, is nearer to the pad "
    "than `safety.min_separation_m`, or that has none",
}


def failsafe_page() -> str:
    """Return the page."""
    limits = WatchdogLimits()
    rows = [_row(number, one, limits) for number, one in enumerate(failsafes(limits), start=1)]
    headings = ("priority", "condition", "reaction", "lasting", "evidence", "in mode", "until", "forgotten", "text")
    return page("Failsafes", _INTRODUCTION, table(headings, rows))


def _row(number: int, one: Failsafe, limits: WatchdogLimits) -> tuple[str, ...]:
    return (
        str(number),
        code(one.condition),
        f"{one.reaction}{', braking first' if one.brake else ''}",
        _lasting(one, limits),
        prose(EVIDENCE[one.condition]),
        ", ".join(sorted(one.modes)),
        str(one.latch),
        "at once" if one.forgets is None else f"{one.forgets:g} s per s",
        prose(one.text.replace("{why}", "...")),
    )


def _lasting(one: Failsafe, limits: WatchdogLimits) -> str:
    if one.after_s == 0.0:
        return "at once"
    if not one.limit:
        return f"{one.after_s:.1f} s"
    passed = f"{getattr(limits, one.limit.rpartition('.')[2]) - one.after_s:.1f}"
    return f"{one.after_s:.1f} s ({code(one.limit)}{'' if passed == '0.0' else f' - {passed} s'})"

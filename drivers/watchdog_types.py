"""Vocabulary of the watchdog: modes, actions, inputs and answers."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from groundstation.bus.messages import STANDING, UNHEARD, AckStage, FlightState, Vector3, Verb
from groundstation.field.behaviour import SafetyValues
from groundstation.vectors import Bounds

_SAFETY = SafetyValues()


class DriverMode(StrEnum):
    """The driver's mode; published in VehicleStatus.mode."""

    CONNECTING = "CONNECTING"
    LANDED = "LANDED"
    TAKING_OFF = "TAKING_OFF"
    HOVER = "HOVER"
    TRACK = "TRACK"
    HOLD = "HOLD"
    LANDING = "LANDING"
    CUT = "CUT"


class Action(StrEnum):
    """The command for the vehicle.

    WAIT: send nothing that could start or end a flight; IDLE: stay on the ground with motors off; CLEAR: likewise, and
    end its emergency; HOVER: stand still if it flies, never take off.
    """

    WAIT = "WAIT"
    IDLE = "IDLE"
    CLEAR = "CLEAR"
    TAKE_OFF = "TAKE_OFF"
    FLY = "FLY"
    HOVER = "HOVER"
    LAND = "LAND"
    CUT = "CUT"


FREE = frozenset({DriverMode.HOVER, DriverMode.TRACK, DriverMode.HOLD})
ALOFT = FREE | {DriverMode.TAKING_OFF}
# Reasons for which a vehicle may refuse, in the operator's words.
REFUSABLE = {Action.TAKE_OFF: "take off", Action.LAND: "land", Action.CUT: "stop its motors"}


@dataclass(frozen=True, slots=True)
class WatchdogLimits:
    """Times and limits of the watchdog [s].

    *_hover_s, *_brake_s, *_land_s, *_told_s: for so long a condition lasts before the vehicle hovers, brakes or lands
    for it, or the operator is told. *resume_*: from then on it waits for RESUME.
    """

    # Silences: of setpoints, of supervisor or vehicle, of the tracker or any part on its way, of this driver's loop.
    hover_after_s: float = _SAFETY.setpoint_lifetime_ms / 1000
    land_after_s: float = _SAFETY.land_after_s
    resume_within_s: float = 1.0
    tracker_resume_within_s: float = 0.5
    gap_s: float = 0.5
    # It lands if no RESUME comes for so long; after a pause of the tracker within land_after_s.
    unresumed_land_s: float = 30.0
    # Hover before landing when it is unknown what the vehicle was doing.
    brake_s: float = 1.0
    unseen_land_after_s: float = _SAFETY.unseen_land_after_s
    battery_min: float = 0.15
    battery_hold_s: float = 3.0
    # Orders: until it flies, until its emergency is cleared, and how long it may fly on after CUT.
    take_off_s: float = 10.0
    clear_s: float = 2.0
    cut_s: float = 2.0
    # What is commanded at most. Actual speeds beyond what gusts and noise explain brake it; flown by others, it lands.
    max_speed_m_s: float = 0.6
    max_climb_m_s: float = 0.4
    fast_brake_s: float = 0.1
    fast_resume_s: float = 0.5
    fast_land_s: float = 1.6
    # It strays from its commands: from 1 m/s it stands after 0.8 s with 2 m/s^2 and a lag of 0.3 s; doubled. If it
    # strays once more within the second time, though it hovers, it lands.
    stray_land_s: float = 1.6
    stray_again_s: float = 5.0
    # Its sensors are wrong, and no camera sees it.
    blind_land_s: float = 1.6
    # Without a position from the cameras, for vehicles that need one.
    lost_hover_s: float = 0.3
    lost_land_s: float = 0.7
    # Nearer to another than allowed, so that it makes way: the limiter moves each of two by 0.1 m in that time.
    min_separation_m: float = 0.6
    crowded_land_s: float = 2.0
    floor_land_s: float = 0.3
    # A landing vehicle rises or flies fast; a healthy one has braked from its take-off in half of this.
    away_told_s: float = 2.0
    # The slowest descent, and what a landing takes beyond it.
    sinks_m_s: float = 0.3
    landing_s: float = 5.0
    # It stands on the floor with running motors: PX4 notices its landing and stops them within 4 s.
    stands_told_s: float = 5.0
    # Where it takes off [x, y; world], and the fence, low and high along x, y and z [world], if known.
    pad_m: tuple[float, float] | None = None
    fence_m: Bounds | None = None
    # One that was pushed out at 0.6 m/s is on its way back within the first.
    outside_hover_s: float = 1.0
    flown_outside_s: float = 0.5

    @property
    def tolerated_speed_m_s(self) -> float:
        """Return the largest actual speed [m/s]."""
        return 1.3 * self.max_speed_m_s + 0.2

    @property
    def tolerated_climb_m_s(self) -> float:
        """Return the largest actual climb [m/s] of a vehicle that others fly."""
        return 1.3 * self.max_climb_m_s + 0.2


class VehicleView(NamedTuple):
    """The vehicle's state by its reports, and what the host adds from estimates and cameras. Words are "" if not so."""

    flight_state: FlightState = FlightState.UNKNOWN
    fresh: bool = False  # telemetry is younger than 0.3 s
    battery: float | None = None
    not_ready: str = ""  # why it may not take off
    configured: bool = True  # the driver has prepared it for flight: while it stands it is not READY before
    unsound: str = ""  # why its reported motion cannot be true: it then counts as silent
    velocity_m_s: Vector3 | None = None  # the reported one, scaled to the true one; None: it reports none
    # By the host: horizontal speed, and climb of one that others fly.
    speed_m_s: float = 0.0
    climb_m_s: float = 0.0
    # How it strays from its commands, which of its velocities says so, and whether cameras show its speed.
    stray: str = ""
    stray_by: str = ""
    seen: bool = False
    unseen_s: float = 0.0  # how long its estimate may have been wrong, by the tracker
    near: str = ""  # airborne vehicle too near to its pad
    crowded: str = ""  # why it makes way for another that is too near in flight
    outside: str = ""  # how far it is outside the fence, if not on its way back to us
    # How long it has lacked a position that it needs; whose, and since when, in words.
    lost_s: float = 0.0
    unlocated: str = "from the cameras"
    clears: bool = False  # a separate order ends its emergency without starting motors
    mute: str = ""  # the report that it lacks although telemetry arrives
    # By its estimate: it comes down to the floor, it is there, and its height.
    touches_down: bool = False
    on_floor: bool = False
    height_m: float = 0.0
    away: str = ""  # how it moves without sinking, by cameras
    homeward: str = ""  # how it flies home or climbs by itself, and in which mode
    foreign: bool = False  # others fly it, so its speed is judged, but not by our commands
    settles: bool = False  # not even its speed: it ends a climb by itself, or a pilot has just let go of it
    piloted: bool = False  # a pilot's sticks may move it
    rises: bool = False  # in HOVER it continues to its take-off height
    fell: str = ""  # that it fell since its last start
    refuses: str = ""  # its answer to the order to take off, if that refused for good
    unarmed: str = ""  # why it does not start its motors yet though it is to take off, in its own words

    @property
    def plausible(self) -> "VehicleView":
        """Return the view to act upon: a vehicle with implausible values counts as silent."""
        return self._replace(fresh=False) if self.unsound and self.fresh else self

    @property
    def flown_by_others(self) -> bool:
        """Return whether others fly it, and have to keep our limits."""
        return self.foreign and not self.settles

    @property
    def silence(self) -> str:
        """Return why the vehicle counts as silent, in words; valid while the view is not fresh."""
        if self.unsound:
            return f"its sensors cannot be believed: {self.unsound}"
        return self.mute or "no telemetry from the vehicle"

    @property
    def flight_ends(self) -> str:
        """Return why its flight is over, or is not to be interrupted any more in ending, or ""."""
        if self.flight_state in STANDING | UNHEARD | {FlightState.LANDING}:
            return f"the vehicle says {self.flight_state}"
        return "it is touching down: let it land, then take off again" if self.touches_down else ""


class Upstream(NamedTuple):
    """State of tracker and supervisor, as the process sees it."""

    supervisor_alive: bool = True
    supervisor_fresh: bool = True
    stop_requested: bool = False


@dataclass(frozen=True, slots=True)
class Ack:
    """An answer to a command."""

    command_id: str
    verb: Verb
    stage: AckStage
    reason: str = ""
    final: bool = False


class WatchdogDecision(NamedTuple):
    """The present decision; velocity and yaw rate count for FLY only. `reason` explains the mode.

    setpoint_ns: stamp of the setpoint obeyed, for vehicles that get each setpoint once; 0 if none is. seen_m_s:
    velocity forward and left by cameras, for a vehicle that brakes without a velocity of its own; None if they do not
    see it. entered_ns: when it entered the mode, or was last ordered into it; only an operator's order leads to TRACK.
    back_m_s: of a vehicle that is to hover, the velocity forward, left and up back to its place; None: it holds its
    place by itself. failsafe: the condition of the row that caused the mode, "" after an order.
    """

    mode: DriverMode
    action: Action
    velocity_m_s: Vector3 = (0.0, 0.0, 0.0)
    yaw_rate_rad_s: float = 0.0
    reason: str = ""
    acks: tuple[Ack, ...] = ()
    setpoint_ns: int = 0
    seen_m_s: tuple[float, float] | None = None
    entered_ns: int = 0
    back_m_s: Vector3 | None = None
    failsafe: str = ""

"""Vehicle state, setpoints and commands."""

from enum import StrEnum

import msgspec

from groundstation.bus.messages.base import Message
from groundstation.time_units import NS_PER_S
from groundstation.vectors import Vector3


class FlightState(StrEnum):
    """State of the flight, as the vehicle reports it."""

    UNKNOWN = "UNKNOWN"
    """Not reported yet."""
    LANDED = "LANDED"
    """On the ground, motors off."""
    TAKING_OFF = "TAKING_OFF"
    """Climbing from the ground."""
    FLYING = "FLYING"
    """In the air, moving."""
    HOVERING = "HOVERING"
    """In the air, holding its place."""
    LANDING = "LANDING"
    """Descending to the ground."""
    EMERGENCY = "EMERGENCY"
    """Motors cut by the vehicle's own emergency stop."""
    LOST = "LOST"
    """The driver no longer hears the vehicle."""


UP = frozenset({FlightState.FLYING, FlightState.HOVERING})
AIRBORNE = UP | {FlightState.TAKING_OFF, FlightState.LANDING}
STANDING = frozenset({FlightState.LANDED, FlightState.EMERGENCY})
UNHEARD = frozenset({FlightState.UNKNOWN, FlightState.LOST})
_ALOFT = frozenset({"HOVER", "TRACK", "HOLD", "LANDING"})
# Values of VehicleStatus.failsafe of a vehicle that is to land, and does not come down, or does not stop its motors:
# they end nothing by themselves.
NOT_DOWN = frozenset({"flies_away", "landing_overdue", "stands_running"})
# Values of VehicleStatus.failsafe with which the tracker may bring a hovering vehicle back to its place: none, or one
# that casts no doubt on what the vehicle does, nor on the tracker.
KEPT_IN_PLACE = frozenset({"", "driver_stood", "supervisor_silent", "sensors_wrong", "back_in_doubt", "state_unknown"})


def known_state(before: FlightState, said: FlightState) -> FlightState:
    """Return the state of a drone from the one that its driver reports and the one known before.

    A driver restarted in flight reports UNKNOWN until the first telemetry of the drone, which may still fly: LOST.
    """
    return FlightState.LOST if said is FlightState.UNKNOWN and before in AIRBORNE | {FlightState.LOST} else said


def stood_last(state: FlightState, mode: str) -> bool:
    """Return whether a lost drone stood at its last telemetry, by state and mode of its VehicleStatus.

    No take-off was ordered since. Most often its battery is empty.
    """
    return state is FlightState.LOST and mode == "LANDED"


def flies(state: FlightState, mode: str) -> bool | None:
    """Return whether a vehicle flies, by state and mode of its VehicleStatus; None: unknown by these.

    A lost one flies if its driver had it in the air. During a take-off it is not known when it leaves the ground.
    """
    if state is FlightState.LOST:
        return True if mode in _ALOFT else None
    return True if state in AIRBORNE - {FlightState.TAKING_OFF} else False if state in STANDING else None


def climbs(state: FlightState, mode: str) -> bool:
    """Return whether a vehicle may be leaving the ground, by state and mode of its VehicleStatus.

    Also one told to take off that has not begun to, or was lost meanwhile.
    """
    told = mode == "TAKING_OFF" and flies(state, mode) is not True
    return told or state is FlightState.TAKING_OFF


class VehicleStatus(Message, frozen=True, kw_only=True):
    """Health of one vehicle and of the link to it (5 Hz)."""

    flight_state: FlightState
    """The vehicle's own report."""
    mode: str
    """Mode of the driver's watchdog: CONNECTING, LANDED, TAKING_OFF, HOVER, TRACK, HOLD, LANDING or CUT."""
    failsafe: str = ""
    """Failsafe that acts or led to this mode, by its condition; empty: a command or the vehicle itself led to it."""
    battery: float | None = None
    """Charge, 0 to 1; none: unknown."""
    link_quality: float | None = None
    """Share of datagrams that arrive, 0 to 1; none: unknown."""
    rate_hz: float = 0.0
    """Rate of the telemetry [Hz]."""
    rejected: dict[str, int] = msgspec.field(default_factory=dict)
    """Datagrams, setpoints and commands that were dropped, by reason."""
    detail: str = ""
    """What the operator should know, in words."""
    not_ready: str = ""
    """Why it may not take off, by its own report and its driver's preparation, in words; empty: it may."""
    firmware: str = ""
    """Its firmware with the version; empty: unknown."""
    braked: bool = False
    """In TRACK: whether a failsafe keeps it hovering; once that is over, it follows setpoints again."""
    lands_in_s: float | None = None
    """Time until a failsafe lands it if nothing changes [s]; none: no landing is due."""
    clock_drift_ppm: float | None = None
    """How much faster the vehicle's clock runs than ours [1e-6]; none: unknown."""
    telemetry_late_ms: float | None = None
    """Largest delay of a packet in the last 30 s, against the freshest of its half second [ms]; none: unknown.
    """
    asks_time: bool | None = None
    """Whether it asks for our time, which it needs to date our messages; none: it does not need it."""


class VelocitySetpoint(Message, frozen=True, kw_only=True):
    """Velocity and yaw rate of one drone, valid for a short time."""

    velocity_m_s: Vector3
    """Velocity [m/s; base_stabilized, FLU]."""
    yaw_rate_rad_s: float
    """Yaw rate [rad/s], counter-clockwise."""
    lifetime_ms: int
    """Time from the stamp after which it expires [ms]."""
    epoch: int
    """Epoch of the tracker that sent it."""
    converged: bool = True
    """Whether the estimate of this drone is good enough to fly on; if not, the drone hovers."""
    holds: bool = False
    """Whether it keeps a hovering drone at its place: obeyed in HOVER and HOLD as well, sideways, within the driver's
    limits."""


class Verb(StrEnum):
    """Discrete requests. Priority: CUT_MOTORS, LAND, HOLD, setpoint, TAKEOFF."""

    TAKEOFF = "TAKEOFF"
    """Take off."""
    TRACK = "TRACK"
    """Obey setpoints."""
    HOLD = "HOLD"
    """Hover until RESUME or TRACK."""
    RESUME = "RESUME"
    """Obey setpoints again after a hold or a new epoch."""
    LAND = "LAND"
    """Land, and stay down until a new TAKEOFF."""
    CUT_MOTORS = "CUT_MOTORS"
    """Stop the motors at once: the drone falls."""

    @property
    def stops(self) -> bool:
        """Return whether it is a stop: anybody may give it, and drivers obey at once."""
        return self in (Verb.HOLD, Verb.LAND, Verb.CUT_MOTORS)


STOP_LIVES_NS = 30 * NS_PER_S
"""Lifetime of a stop [ns]. Senders stop repeating earlier, so an older one comes from a stalled queue."""


OPERATOR = "operator"
"""In a command's scope: the run's operator is asked to carry it out for the drones named beside it."""


class Command(Message, frozen=True, kw_only=True):
    """A request to the drivers."""

    id: str
    """Names the command; a repeated id is acknowledged again, not obeyed again."""
    verb: Verb
    """What to do."""
    scope: tuple[str, ...]
    """Drones it is meant for; empty: all; with OPERATOR: drones it is about."""
    issuer: str
    """Process that gave it."""
    expires_ns: int = 0
    """Time after which it is ignored [ns; boot clock]; 0: as for all stops, 30 s after its stamp."""
    run: str = ""
    """Run that it was given for: drivers of another refuse it."""
    anyway: bool = False
    """Of a TAKEOFF: take off although the preflight checks forbid it."""


class AckStage(StrEnum):
    """How far a command has come at one driver."""

    RECEIVED = "RECEIVED"
    """The driver has the command."""
    ACCEPTED = "ACCEPTED"
    """The driver acts on it."""
    EFFECTIVE = "EFFECTIVE"
    """The vehicle carries the command out."""
    REFUSED = "REFUSED"
    """The driver will not do it."""


class CommandAck(Message, frozen=True, kw_only=True):
    """One driver's answer to one command."""

    command_id: str
    """Id of the command."""
    verb: Verb
    """Verb of the command."""
    stage: AckStage
    """How far it has come."""
    reason: str = ""
    """Why it was refused."""
    final: bool = False
    """Refused, and only a person may give the same order anew: it did something, and would start motors next time."""


class Lease(Message, frozen=True, kw_only=True):
    """The operator's lease: drivers accept TAKEOFF, TRACK and RESUME from its holder only."""

    holder: str
    """The operator's process."""
    expires_ns: int
    """Time until which the lease holds [ns; boot clock]."""
    run: str = ""
    """Run that the lease belongs to; commands of other hosts have to name it."""

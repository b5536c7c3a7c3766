"""Vehicle state, setpoints and commands."""

from enum import StrEnum

import msgspec

from groundstation.bus.messages.base import Message, Vector3


class FlightState(StrEnum):
    """What the vehicle itself says it is doing."""

    UNKNOWN = "UNKNOWN"
    LANDED = "LANDED"
    TAKING_OFF = "TAKING_OFF"
    FLYING = "FLYING"
    HOVERING = "HOVERING"
    LANDING = "LANDING"
    EMERGENCY = "EMERGENCY"
    LOST = "LOST"


class VehicleStatus(Message, frozen=True, kw_only=True):
    """Health of one vehicle and of the link to it (5 Hz).

    mode: the driver's own mode (see drivers.watchdog); battery, link_quality in 0..1; rate_hz of its telemetry;
    rejected: datagrams dropped, by reason.
    """

    flight_state: FlightState
    mode: str
    battery: float | None = None
    link_quality: float | None = None
    rate_hz: float = 0.0
    rejected: dict[str, int] = msgspec.field(default_factory=dict)
    detail: str = ""


class VelocitySetpoint(Message, frozen=True, kw_only=True):
    """Velocity [base_stabilized, FLU] and yaw rate (counter-clockwise) that expire after `lifetime_ms`.

    epoch: identifies the tracker's life; converged: its belief of this drone is fit to fly on.
    """

    velocity_m_s: Vector3
    yaw_rate_rad_s: float
    lifetime_ms: int
    epoch: int
    converged: bool = True


class Verb(StrEnum):
    """Discrete requests, in no order; their priority is in drivers.watchdog."""

    TAKEOFF = "TAKEOFF"
    TRACK = "TRACK"
    HOLD = "HOLD"
    RESUME = "RESUME"
    LAND = "LAND"
    CUT_MOTORS = "CUT_MOTORS"


class Command(Message, frozen=True, kw_only=True):
    """A request to the drivers in `scope` (empty: all). `expires_ns` is 0 for stops, which never expire."""

    id: str
    verb: Verb
    scope: tuple[str, ...]
    issuer: str
    expires_ns: int = 0


class AckStage(StrEnum):
    """How far a command has come at one driver."""

    RECEIVED = "RECEIVED"
    ACCEPTED = "ACCEPTED"
    EFFECTIVE = "EFFECTIVE"
    REFUSED = "REFUSED"


class CommandAck(Message, frozen=True, kw_only=True):
    """One driver's word on one command; `reason` names why it was refused."""

    command_id: str
    verb: Verb
    stage: AckStage
    reason: str = ""


class Lease(Message, frozen=True, kw_only=True):
    """Who is operator until `expires_ns`; drivers accept TAKEOFF, TRACK and RESUME only from the holder."""

    holder: str
    expires_ns: int

"""Every message on the bus, once: frozen values whose floats are finite, with unknowns as `None`.

Frames and units follow the field names; covariances are row-major tuples of an (n, n) matrix.
"""

import math
from enum import StrEnum
from typing import Any

import msgspec

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def _is_finite(value: Any) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, tuple):
        return all(_is_finite(item) for item in value)
    return True


class Header(msgspec.Struct, frozen=True, gc=False):
    """Who says what about whom, and when it was measured.

    stamp_ns: time of measurement on the boot clock named by `clock` [ns]; entity: whom it is about;
    source: who says so; seq: rises by one per (key, sender).
    """

    stamp_ns: int
    clock: str
    entity: str
    source: str
    seq: int


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """Base of all messages: a header, and fields whose floats are finite (ValueError otherwise)."""

    header: Header

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            if not _is_finite(getattr(self, name)):
                raise ValueError(f"{name} is not finite")


def _require_square(name: str, covariance: tuple[float, ...], sizes: tuple[int, ...]) -> None:
    if len(covariance) not in {n * n for n in sizes}:
        raise ValueError(f"{name} has {len(covariance)} entries, expected one of {[n * n for n in sizes]}")


class ImuSample(Message, frozen=True, kw_only=True):
    """Body rates and specific force [base, FLU], with the device's own attitude (wxyz) if it has one."""

    angular_velocity_rad_s: Vector3
    specific_force_m_s2: Vector3
    attitude: Quaternion | None = None


class Odometry(Message, frozen=True, kw_only=True):
    """What a vehicle measured of its own motion; never an integral of ours.

    velocity_m_s [base_stabilized, FLU], velocity_covariance 3x3 row-major; yaw_rad [odom, counter-clockwise];
    roll_rad, pitch_rad [base_stabilized -> base, FLU: roll right side down positive, pitch nose down positive];
    height_m above ground; position_m [odom]; reset rises by one
    when yaw or position jump: increments across it are void.
    """

    velocity_m_s: Vector3
    velocity_covariance: tuple[float, ...]
    yaw_rad: float
    roll_rad: float
    pitch_rad: float
    height_m: float | None = None
    position_m: Vector3 | None = None
    reset: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_square("velocity_covariance", self.velocity_covariance, (3,))


class PoseHypothesis(msgspec.Struct, frozen=True):
    """The other solution of an ambiguous planar pose, in the units of `RelativeObservation`."""

    position_m: Vector3
    yaw_rad: float | None
    covariance: tuple[float, ...]


class RelativeObservation(Message, frozen=True, kw_only=True):
    """One entity's marker as seen by one camera.

    header.entity is the observer (a drone, or the name of a world-fixed camera); header.stamp_ns the exposure.
    position_m: marker centre [camera_optical]. yaw_rad: heading of the subject relative to the observer's
    base_stabilized x axis (for world-fixed cameras: relative to the world x axis), counter-clockwise, or None.
    covariance: of (position, yaw), 4x4 row-major, or 3x3 without yaw.
    margin: identity margin of the detector (> 1 is sure).
    roll_rad, pitch_rad: observer's attitude that the yaw was derived with (0 for world-fixed cameras).
    """

    observer: str
    subject: str
    camera: str
    position_m: Vector3
    yaw_rad: float | None
    covariance: tuple[float, ...]
    alternative: PoseHypothesis | None = None
    margin: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_square("covariance", self.covariance, (3,) if self.yaw_rad is None else (4,))


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
    rejected: dict[str, int] = {}
    detail: str = ""


class CameraStatus(Message, frozen=True, kw_only=True):
    """Health of one camera process (2 Hz)."""

    connected: bool
    fps: float
    age_ms: float
    frames: int
    skipped: int
    detections: int
    detail: str = ""


class EntityEstimate(msgspec.Struct, frozen=True):
    """Mean and own covariance of one entity.

    Robots: mean (x, y, z, yaw) [m, m, m, rad; world], velocity (3) [m/s; world]. Target: mean (x, y), velocity (2).
    covariance: row-major, of the mean. age_s: since it was last corrected by an observation.
    """

    name: str
    kind: str
    mean: tuple[float, ...]
    covariance: tuple[float, ...]
    velocity_m_s: tuple[float, ...]
    converged: bool
    age_s: float


class Estimate(Message, frozen=True, kw_only=True):
    """All entities of the belief, predicted to the header's stamp (50 Hz)."""

    entities: tuple[EntityEstimate, ...]
    epoch: int


class Belief(Message, frozen=True, kw_only=True):
    """The joint belief: mean, upper triangle of the covariance packed by rows, and what each entry is (<= 5 Hz)."""

    mean: tuple[float, ...]
    covariance_upper: tuple[float, ...]
    layout: tuple[str, ...]


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


class Alternative(msgspec.Struct, frozen=True):
    """A topology that was considered, with its cost, or its lower bound if it was dropped with proof."""

    topology: str
    cost: float
    bound_only: bool = False


class Control(msgspec.Struct, frozen=True):
    """Planned velocity of one robot: (vx, vy, vz) [base_stabilized] and yaw rate, with what safety changed."""

    robot: str
    velocity_m_s: Vector3
    yaw_rate_rad_s: float
    limited_by: tuple[str, ...] = ()


class Edge(msgspec.Struct, frozen=True):
    """A permitted observation of the chosen topology and the information it is expected to bring [1/m^2]."""

    observer: str
    subject: str
    information: float


class SolverReport(msgspec.Struct, frozen=True):
    """What the optimiser did: status, cost evaluations, CPU seconds, topologies looked at and optimised."""

    status: str
    evaluations: int
    seconds: float
    topologies: int
    survivors: int


class Plan(Message, frozen=True, kw_only=True):
    """The chosen topology with its controls and cost [m^2], beside the alternatives."""

    topology: str
    cost: float
    controls: tuple[Control, ...]
    edges: tuple[Edge, ...]
    alternatives: tuple[Alternative, ...]
    solver: SolverReport
    mode: str


class Verdict(StrEnum):
    """What became of a measurement."""

    ACCEPTED = "ACCEPTED"
    INFLATED = "INFLATED"
    LATE = "LATE"
    UNSYNCED = "UNSYNCED"
    OUT_OF_VIEW = "OUT_OF_VIEW"
    AMBIGUOUS = "AMBIGUOUS"
    SINGULAR = "SINGULAR"
    UNKNOWN_ENTITY = "UNKNOWN_ENTITY"
    IMPLAUSIBLE = "IMPLAUSIBLE"
    DUPLICATE = "DUPLICATE"
    NOT_PERMITTED = "NOT_PERMITTED"


class Innovation(Message, frozen=True, kw_only=True):
    """Why a correction did what it did: residual y, its covariance S (row-major), NIS, verdict and edge."""

    observer: str
    subject: str
    verdict: Verdict
    residual: tuple[float, ...] = ()
    covariance: tuple[float, ...] = ()
    nis: float | None = None
    latency_ms: float = 0.0
    reason: str = ""


class Severity(StrEnum):
    """How loud an event is."""

    INFO = "INFO"
    WARNING = "WARNING"
    ERROR = "ERROR"


class Event(Message, frozen=True, kw_only=True):
    """Something that happened, about header.entity, with what the operator can do about it."""

    severity: Severity
    text: str
    remedy: str = ""


class Lifecycle(StrEnum):
    """States of every process."""

    STARTING = "STARTING"
    READY = "READY"
    DEGRADED = "DEGRADED"
    STOPPING = "STOPPING"


class ProcessStatus(Message, frozen=True, kw_only=True):
    """Lifecycle, CPU use (share of one core since the last status) and deadlines of one process (1 Hz)."""

    state: Lifecycle
    pid: int
    cpu: float
    ticks: int = 0
    overruns: int = 0
    overflowed: int = 0
    detail: str = ""


class ClockOffset(Message, frozen=True, kw_only=True):
    """Offset to add to stamps of clock `of` to read them on header.clock [ns]."""

    of: str
    offset_ns: int


class JournalEntry(Message, frozen=True, kw_only=True):
    """One tick of the tracker: what it ingested in which order, and what it planned.

    ingested: (key, seq) pairs in order; now_ns; plan_tick: tick whose plan was adopted now (or -1);
    evaluations and stop_reason of that plan.
    """

    tick: int
    now_ns: int
    ingested: tuple[tuple[str, int], ...]
    plan_tick: int = -1
    evaluations: int = 0
    stop_reason: str = ""


class TruthState(Message, frozen=True, kw_only=True):
    """Ground truth of one body in the simulator: position, velocity [world], roll, pitch, yaw [FLU], and contact."""

    position_m: Vector3
    velocity_m_s: Vector3
    attitude_rad: Vector3
    on_ground: bool


class SimCommand(Message, frozen=True, kw_only=True):
    """Steering of a simulated body (the TurtleBot): forward speed and turn rate, or back to its path."""

    action: str
    speed_m_s: float = 0.0
    turn_rate_rad_s: float = 0.0
    position_m: Vector3 | None = None


class SimStatus(Message, frozen=True, kw_only=True):
    """How well the simulator keeps real time: ticks, late ticks, and per-body contact."""

    ticks: int
    overruns: int
    airborne: tuple[str, ...] = ()

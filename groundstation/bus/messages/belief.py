"""What the tracker believes and why."""

from enum import StrEnum

import msgspec

from groundstation.bus.messages.base import Message


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


class SensorLateness(msgspec.Struct, frozen=True):
    """By how much longer a camera's way to us seems than its setting says, and one sigma [ms]; nothing acts on it."""

    sensor: str
    offset_ms: float
    std_ms: float


class Belief(Message, frozen=True, kw_only=True):
    """The joint belief: mean, upper triangle of the covariance packed by rows, and what each entry is (<= 5 Hz).

    lateness: of the cameras whose delay the flight tells.
    """

    mean: tuple[float, ...]
    covariance_upper: tuple[float, ...]
    layout: tuple[str, ...]
    lateness: tuple[SensorLateness, ...] = ()


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
    FROZEN = "FROZEN"


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

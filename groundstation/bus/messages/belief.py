"""The tracker's belief, and its verdict on each measurement."""

from enum import StrEnum

import msgspec

from groundstation.bus.messages.base import Message

NEVER_S = 1e6
"""Time that stands for "since ever": a message holds finite numbers."""


class EntityEstimate(msgspec.Struct, frozen=True):
    """Mean and own covariance of one entity."""

    name: str
    """The robot or target."""
    kind: str
    """`robot` or `target`."""
    mean: tuple[float, ...]
    """Robot: (x, y, z, yaw) [m, m, m, rad; world]. Target: (x, y) [m; world]."""
    covariance: tuple[float, ...]
    """Covariance of the mean, row-major."""
    velocity_m_s: tuple[float, ...]
    """Robot: (vx, vy, vz) [m/s; world]. Target: (vx, vy)."""
    converged: bool
    """Whether the estimate is good enough to fly on."""
    age_s: float
    """Time since the last observation that corrected it [s]; `NEVER_S`: there was none."""
    unlocalised_s: float = 0.0
    """For how long a flying robot may not have been where it is believed [s]; 0 while it is known."""
    contradicted: bool = False
    """Whether sightings far from this place contradict it; until that is settled, nothing should rely on it."""
    sighting: tuple[float, float] | None = None
    """Time since the entity itself was last seen [s], and the standard deviation of its position right after that, the
    larger one of x and y [m]."""
    velocity_covariance: tuple[float, ...] | None = None
    """Covariance of the velocity, row-major [m^2/s^2]: of a robot's ahead along its heading, to the left and up; of a
    target's (vx, vy); none: not told."""


class TargetSearch(msgspec.Struct, frozen=True):
    """The search for a target that was not seen where it was expected."""

    target: str
    """The target."""
    mode: str
    """`SEARCH`, or `LOST` once most of the room was searched: a person is asked."""
    since_s: float
    """For how long it has lasted [s]."""
    place_m: tuple[float, float]
    """Where the target most likely is [m; world]."""
    searched: float
    """Share of the room that was searched, of that which the team can see (`floor`)."""
    expected_s: float | None
    """Estimated remaining time [s]; none: no robot can search."""
    text: str
    """The same in words."""
    floor: str = "the room"
    """What `searched` is a share of, in words: the room, or the part of it that the team can see."""


class SearchMap(Message, frozen=True, kw_only=True):
    """Where in the room a missing target may be, in square cells over the floor (2 Hz during a search)."""

    first_m: tuple[float, float]
    """Centre of the first cell, that with the least x and y [m; world]."""
    cell_m: float
    """Side of a cell [m]."""
    columns: int
    """Cells along x."""
    chances: tuple[int, ...]
    """Probability of each cell in 255ths of the likeliest one's, row by row, y rising."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.cell_m <= 0.0 or self.columns < 1 or not self.chances or len(self.chances) % self.columns:
            raise ValueError(f"{len(self.chances)} chances are no rows of {self.columns} cells of {self.cell_m:g} m")
        if not 0 <= min(self.chances) <= max(self.chances) <= 255:
            raise ValueError("chances must be 0 to 255")


class Estimate(Message, frozen=True, kw_only=True):
    """All entities of the belief, predicted to the header's stamp (50 Hz)."""

    entities: tuple[EntityEstimate, ...]
    """One estimate per robot and target."""
    epoch: int
    """The tracker's epoch: rises when it restarts or its belief breaks."""
    searches: tuple[TargetSearch, ...] = ()
    """One search per target that is searched for."""


class SensorLateness(msgspec.Struct, frozen=True):
    """Estimated error of a camera's configured delay, for the operator only."""

    sensor: str
    """The camera."""
    offset_ms: float
    """True delay minus configured delay [ms]."""
    std_ms: float
    """Standard deviation of the offset [ms]."""


class MovedCamera(msgspec.Struct, frozen=True):
    """A fixed camera that was bumped since the team took off."""

    sensor: str
    """The camera."""
    since_ns: int
    """Until then all that it saw was in place [ns], on the header's clock; 0: that is not known."""


class Belief(Message, frozen=True, kw_only=True):
    """The joint belief over all robots and targets (at most 5 Hz)."""

    mean: tuple[float, ...]
    """Mean of the joint state, in the order of `layout`."""
    covariance_upper: tuple[float, ...]
    """Upper triangle of its covariance, packed by rows."""
    layout: tuple[str, ...]
    """What each entry of the mean is, such as `drone_1.x`."""
    lateness: tuple[SensorLateness, ...] = ()
    """Delay errors of the cameras whose delay the flight reveals."""
    moved: tuple[MovedCamera, ...] = ()
    """The cameras that were bumped, until all have landed."""


class SuspectedFigure(msgspec.Struct, frozen=True):
    """A suspected figure of the field, or several that cannot be told apart."""

    entity: str
    """The likeliest entity whose figure it is; empty: all."""
    text: str
    """What is wrong, and by how much, in a few words."""
    remedy: str
    """What a person can do about it."""
    told_ns: int
    """When it was first reported [ns], on the header's clock."""
    about: str = ""
    """Which figure it is: stays the same until it is withdrawn, while the text may change."""


class Suspicion(Message, frozen=True, kw_only=True):
    """Which figures of the field are suspected in flight, for the operator only."""

    cause: str
    """The best explanation for sightings that disagree, in a few words; empty: no figure is suspected."""
    figures: tuple[SuspectedFigure, ...] = ()
    """All that are suspected, each until it is withdrawn."""


class Verdict(StrEnum):
    """The estimator's treatment of a measurement."""

    ACCEPTED = "ACCEPTED"
    """Fused as it is."""
    INFLATED = "INFLATED"
    """Beyond the gate: fused with a covariance inflated until it lies on the gate."""
    LATE = "LATE"
    """Older than `estimator.max_lateness_s`."""
    UNSYNCED = "UNSYNCED"
    """Its clock has no known offset."""
    OUT_OF_VIEW = "OUT_OF_VIEW"
    """The subject would be behind the camera."""
    AMBIGUOUS = "AMBIGUOUS"
    """It cannot be placed: a heading is missing, or this sensor alone cannot locate its subject."""
    SINGULAR = "SINGULAR"
    """Its covariance is not positive definite, or of the wrong shape."""
    UNKNOWN_ENTITY = "UNKNOWN_ENTITY"
    """Observer or subject is not in the field, not in the belief yet, or does not fly."""
    IMPLAUSIBLE = "IMPLAUSIBLE"
    """Far beyond the gate, absurdly large, or from the future."""
    DUPLICATE = "DUPLICATE"
    """The same message arrived before."""
    NOT_PERMITTED = "NOT_PERMITTED"
    """This camera must not observe targets."""
    FROZEN = "FROZEN"
    """Repeats itself: its sensor or stream is stuck."""


class Innovation(Message, frozen=True, kw_only=True):
    """The estimator's result for one observation."""

    observer: str
    """Entity that observed."""
    subject: str
    """Entity that was observed."""
    verdict: Verdict
    """The estimator's treatment of the observation."""
    residual: tuple[float, ...] = ()
    """Residual y = z - h(x), in the units of the measurement."""
    covariance: tuple[float, ...] = ()
    """Covariance S of the residual, row-major."""
    nis: float | None = None
    """Normalised innovation squared, y' S^-1 y, of as many degrees of freedom as y has entries."""
    latency_ms: float = 0.0
    """Time from the measurement to its arrival [ms]."""
    reason: str = ""
    """Reason for a verdict other than ACCEPTED, in words."""


class JournalEntry(Message, frozen=True, kw_only=True):
    """One tick of the tracker: its inputs in order, and the plan it adopted. Replay follows it."""

    tick: int
    """Number of the tick."""
    now_ns: int
    """The tick's time [ns; boot clock]."""
    ingested: tuple[tuple[str, int], ...]
    """(key, seq) of each message, in the order of ingestion."""
    plan_tick: int = -1
    """Tick whose belief the plan adopted now started from; -1: no plan was adopted."""
    evaluations: int = 0
    """Cost evaluations of that plan."""
    stop_reason: str = ""
    """Why its search ended."""

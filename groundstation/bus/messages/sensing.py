"""Measurements of devices, and their health."""

import msgspec

from groundstation.bus.messages.base import Message, require_square
from groundstation.vectors import Quaternion, Vector3


class ImuSample(Message, frozen=True, kw_only=True):
    """Body rates and specific force of a vehicle."""

    angular_velocity_rad_s: Vector3
    """Body rates [rad/s; base, FLU]."""
    specific_force_m_s2: Vector3
    """Specific force [m/s^2; base, FLU]."""
    attitude: Quaternion | None = None
    """The device's own attitude, quaternion (w, x, y, z), if it has one."""


class Odometry(Message, frozen=True, kw_only=True):
    """A vehicle's measurement of its own motion; never an integral of ours."""

    velocity_m_s: Vector3
    """Velocity [m/s; base_stabilized, FLU]."""
    velocity_covariance: tuple[float, ...]
    """Covariance of the velocity [m^2/s^2], 3x3 row-major."""
    yaw_rad: float
    """Heading [rad; odom], counter-clockwise."""
    roll_rad: float
    """Roll [rad], right side down positive."""
    pitch_rad: float
    """Pitch [rad], nose down positive."""
    height_m: float | None = None
    """Height above the ground [m], if measured."""
    position_m: Vector3 | None = None
    """Position [m; odom], if measured."""
    reset: int = 0
    """Rises by one when yaw or position jump: differences across a reset mean nothing."""
    attitude_std_rad: float = 0.0
    """Standard deviation of roll and of pitch [rad]; 0: that of the field file."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_square("velocity_covariance", self.velocity_covariance, (3,))


class PoseHypothesis(msgspec.Struct, frozen=True):
    """The other solution of an ambiguous planar pose."""

    position_m: Vector3
    """As in `RelativeObservation`."""
    yaw_rad: float | None
    """As in `RelativeObservation`."""
    covariance: tuple[float, ...]
    """As in `RelativeObservation`."""


class RelativeObservation(Message, frozen=True, kw_only=True):
    """One entity's marker as seen by one camera; stamped with the exposure, about the observer."""

    observer: str
    """A drone, or the name of a world-fixed camera or of a motion capture system."""
    subject: str
    """The robot or target whose marker was seen."""
    camera: str
    """The camera or the motion capture system."""
    position_m: Vector3
    """Centre of the marker [m; camera_optical; motion capture: from the world's origin, along the world's axes]."""
    yaw_rad: float | None
    """Heading of the subject [rad], counter-clockwise, relative to the observer's base_stabilized x axis (what is fixed
    in the world: world x axis); none: unknown."""
    covariance: tuple[float, ...]
    """Covariance of (position, yaw), 4x4 row-major, or 3x3 without yaw."""
    alternative: PoseHypothesis | None = None
    """The other pose, where the planar ambiguity stands."""
    margin: float = 0.0
    """Identity margin of the detector; above 1 is sure."""
    roll_rad: float = 0.0
    """Roll of the observer that the yaw was derived with [rad]; 0 for world-fixed cameras, and, with a wide covariance,
    where it is unknown."""
    pitch_rad: float = 0.0
    """Pitch, likewise [rad]."""
    picture_ns: int = 0
    """Exposure of the picture [ns]; that of the last new one, if this one shows nothing new; 0: unknown."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_square("covariance", self.covariance, (3,) if self.yaw_rad is None else (4,))


class RangeObservation(Message, frozen=True, kw_only=True):
    """The ranges of one robot's transponder to the anchors of a ranging system; stamped with their measurement."""

    observer: str
    """The ranging system."""
    subject: str
    """The robot."""
    ranges_m: dict[str, float]
    """Distance of the transponder to each anchor that answered, by the anchor's name [m]."""
    std_m: float
    """Standard deviation of each [m], without errors that last for seconds."""
    position_m: Vector3 | None = None
    """Position of the transponder by these ranges alone [m; world]; none: too few, or they contradict each other."""
    covariance: tuple[float, ...] = (0.0,) * 9
    """Covariance of that position [m^2], 3x3 row-major."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_square("covariance", self.covariance, (3,))


class ReportedMotion(Message, frozen=True, kw_only=True):
    """A target's report of its own motion: a claim, overruled by what cameras see."""

    velocity_m_s: tuple[float, float]
    """Velocity forward and to the left [m/s; base]."""
    std_m_s: float
    """Standard deviation of each of them [m/s]."""


class SearchedPicture(Message, frozen=True, kw_only=True):
    """A picture that could show markers and was searched all over, even if it has none; stamped with the exposure."""

    observer: str
    """A drone, or the name of a world-fixed camera."""
    camera: str
    """The camera."""
    found: tuple[str, ...] = ()
    """The robots and targets whose markers it shows."""
    unmeasured: tuple[str, ...] = ()
    """Those that it may show besides, without a sighting: of markers that cannot be read, are refused or repeat one."""

    def may_show(self, name: str) -> bool:
        """Return whether a robot or target may be in it: then it is no evidence that it is elsewhere."""
        return name in self.found or name in self.unmeasured


class BodyPose(msgspec.Struct, frozen=True):
    """Where a motion capture system has one body."""

    name: str
    """The robot or target."""
    position_m: Vector3
    """Its centre [m; world]; of a target, the point of the floor below its centre."""
    attitude: Quaternion
    """world_from_base as quaternion (w, x, y, z)."""


class BodyPoses(Message, frozen=True, kw_only=True):
    """All bodies that a motion capture system tracked in one frame; stamped with the exposure."""

    bodies: tuple[BodyPose, ...]
    """The bodies."""
    refused: dict[str, str] = msgspec.field(default_factory=dict)
    """Those of the bodies whose poses cannot be true, and why."""


class CameraStatus(Message, frozen=True, kw_only=True):
    """Health of one camera process (2 Hz)."""

    connected: bool
    """Whether pictures arrive."""
    fps: float
    """Pictures processed per second."""
    age_ms: float
    """Age of the newest picture [ms]."""
    frames: int
    """Pictures processed so far."""
    skipped: int
    """Pictures that were overtaken by newer ones."""
    detections: int
    """Observations so far."""
    detail: str = ""
    """What is wrong, in words."""
    rejected: dict[str, int] = msgspec.field(default_factory=dict)
    """What was refused since the start, by reason."""
    brightness: float | None = None
    """Mean grey value of the newest picture, 0 to 1; none: there is no picture."""
    edge_px: float | None = None
    """Width of its sharpest edges [px]; none: nothing in it has contrast."""

"""What devices measured."""

import msgspec

from groundstation.bus.messages.base import Message, Quaternion, Vector3, require_square


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
        require_square("velocity_covariance", self.velocity_covariance, (3,))


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
        require_square("covariance", self.covariance, (3,) if self.yaw_rad is None else (4,))


class CameraStatus(Message, frozen=True, kw_only=True):
    """Health of one camera process (2 Hz); rejected: what was refused since its start, by reason."""

    connected: bool
    fps: float
    age_ms: float
    frames: int
    skipped: int
    detections: int
    detail: str = ""
    rejected: dict[str, int] = msgspec.field(default_factory=dict)


class ClockOffset(Message, frozen=True, kw_only=True):
    """Offset to add to stamps of clock `of` to read them on header.clock [ns]."""

    of: str
    offset_ns: int

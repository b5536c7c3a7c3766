"""Inputs and results of the filter, as values without headers.

Structs, as messages are: one is made of each message, and a frozen dataclass takes ten times as long to make.
"""

import msgspec

from groundstation.bus.messages import PoseHypothesis, Verdict


class Measurement(msgspec.Struct, frozen=True, gc=False):
    """One camera's relative pose of one entity, as in bus.messages.RelativeObservation."""

    stamp_ns: int
    camera: str
    subject: str
    position_m: tuple[float, float, float]
    yaw_rad: float | None
    covariance: tuple[float, ...]
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    alternative: PoseHypothesis | None = None


class SensorReading(msgspec.Struct, frozen=True, gc=False):
    """One reading of any sensor: z (1 to 4 rows as its model says) with its covariance (row-major), of one subject.

    subject: the carrier itself where the sensor looks at nothing else (a heading). roll, pitch: the carrier's, as
    reported.
    """

    stamp_ns: int
    sensor: str
    subject: str
    z: tuple[float, ...]
    covariance: tuple[float, ...]
    roll_rad: float = 0.0
    pitch_rad: float = 0.0


class OdometrySample(msgspec.Struct, frozen=True, gc=False):
    """One odometry sample of a robot: velocity [base_stabilized], its own heading [odom], height above ground.

    yaw_rate_rad_s: for vehicles that are commanded, or measure, a turn rate and no heading. roll, pitch: how it leans.
    attitude_std [rad], yaw_std [rad per root second], velocity_std [m/s]: errors of roll and pitch, of the heading's
    increments and of the velocity; 0: as the robot's model has them, which is also the least of the last.
    """

    stamp_ns: int
    velocity_m_s: tuple[float, float, float]
    yaw_rad: float = 0.0
    height_m: float | None = None
    reset: int = 0
    yaw_rate_rad_s: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    attitude_std_rad: float = 0.0
    yaw_std_rad: float = 0.0
    velocity_std_m_s: float = 0.0


class Correction(msgspec.Struct, frozen=True, gc=False):
    """What one measurement did: residual y, its covariance S (row-major), NIS and verdict.

    joined: the subject entered the state by it (again, where the verdict says so in `reason`). ahead: which way and how
    far from its belief the subject was seen, in deviations [world]; zero for all but targets.
    """

    observer: str
    subject: str
    verdict: Verdict
    reason: str = ""
    residual: tuple[float, ...] = ()
    covariance: tuple[float, ...] = ()
    nis: float | None = None
    latency_ms: float = 0.0
    joined: bool = False
    ahead: tuple[float, float] = (0.0, 0.0)

    @property
    def is_report(self) -> bool:
        """Return whether it is no sighting, but what its subject said of its own motion."""
        return self.observer == self.subject

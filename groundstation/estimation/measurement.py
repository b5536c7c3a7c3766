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

    subject: the carrier itself if the sensor observes nothing else (a heading). roll, pitch: the carrier's, as
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

    yaw_rate_rad_s: for vehicles that have a commanded or measured turn rate but no heading. roll, pitch: of the
    vehicle. attitude_std [rad], yaw_std [rad per root second], velocity_std [m/s]: errors of roll and pitch, of the
    heading's increments and of the velocity; 0: as in the robot's model, which is also the minimum for the last.
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
    """The effect of one measurement: residual y, its covariance S (row-major), NIS and verdict.

    joined: the subject entered the state by it (again, where the verdict says so in `reason`). ahead: direction and
    distance of the sighting from the belief of its subject, in deviations [world]; targets only.
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
        """Return whether it is not a sighting, but its subject's report of its own motion."""
        return self.observer == self.subject

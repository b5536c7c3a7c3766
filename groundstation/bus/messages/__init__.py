"""Every message on the bus, once: frozen values whose floats are finite, with unknowns as `None`.

Frames and units follow the field names; covariances are row-major tuples of an (n, n) matrix.
"""

from groundstation.bus.messages.base import Header, Message, Quaternion, Vector3
from groundstation.bus.messages.belief import (
    Belief,
    EntityEstimate,
    Estimate,
    Innovation,
    JournalEntry,
    SearchMap,
    SensorLateness,
    Suspicion,
    TargetSearch,
    Verdict,
)
from groundstation.bus.messages.flight import (
    OPERATOR,
    STOP_LIVES_NS,
    AckStage,
    Command,
    CommandAck,
    FlightState,
    Lease,
    VehicleStatus,
    VelocitySetpoint,
    Verb,
)
from groundstation.bus.messages.hosts import ClockOffset, HostAnswer, HostOrder, HostReport, Supervision
from groundstation.bus.messages.plan import Alternative, Control, Edge, Plan, SolverReport
from groundstation.bus.messages.preflight import Preflight, PreflightFinding
from groundstation.bus.messages.process import RUN, Event, Lifecycle, ProcessStatus, Severity
from groundstation.bus.messages.sensing import (
    BodyPose,
    BodyPoses,
    CameraStatus,
    ImuSample,
    Odometry,
    PoseHypothesis,
    RangeObservation,
    RelativeObservation,
    ReportedMotion,
    SearchedPicture,
)
from groundstation.bus.messages.simulation import SimCommand, SimStatus, TruthState

__all__ = [
    "RUN",
    "OPERATOR",
    "STOP_LIVES_NS",
    "AckStage",
    "Alternative",
    "Belief",
    "BodyPose",
    "BodyPoses",
    "CameraStatus",
    "ClockOffset",
    "Command",
    "CommandAck",
    "Control",
    "Edge",
    "EntityEstimate",
    "Estimate",
    "Event",
    "FlightState",
    "Header",
    "HostAnswer",
    "HostOrder",
    "HostReport",
    "ImuSample",
    "Innovation",
    "JournalEntry",
    "Lease",
    "Lifecycle",
    "Message",
    "Odometry",
    "Plan",
    "PoseHypothesis",
    "Preflight",
    "PreflightFinding",
    "ProcessStatus",
    "Quaternion",
    "RangeObservation",
    "RelativeObservation",
    "ReportedMotion",
    "SearchMap",
    "SearchedPicture",
    "SensorLateness",
    "Severity",
    "SimCommand",
    "SimStatus",
    "SolverReport",
    "Supervision",
    "Suspicion",
    "TargetSearch",
    "TruthState",
    "Vector3",
    "VehicleStatus",
    "VelocitySetpoint",
    "Verb",
    "Verdict",
]

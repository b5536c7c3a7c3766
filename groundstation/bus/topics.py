"""The one table of topics: liveness, freshness, recording and documentation are derived from it."""

from dataclasses import dataclass
from enum import StrEnum

from groundstation.bus import messages as m
from groundstation.bus.roles import PROCESSES, Role


class Quality(StrEnum):
    """Delivery classes; all of them drop rather than block."""

    CONTROL = "control"
    """Setpoints and commands: first in every queue, delivered at once."""
    SENSOR = "sensor"
    """Measurements: high priority, delivered at once."""
    STATE = "state"
    """What the tracker and the processes report."""
    BULK = "bulk"
    """Pictures, datagrams, journal: last in every queue."""


class Plane(StrEnum):
    """The key space of a topic; production wildcards match neither `@truth` nor `@sim`."""

    PRODUCTION = ""
    """Everything that flies."""
    TRUTH = "@truth"
    """Ground truth, for judging and showing a run."""
    SIM = "@sim"
    """Control of the simulator."""


@dataclass(frozen=True, slots=True)
class Topic:
    """A name on the bus; `type` is None for raw bytes (their `Header` travels as attachment).

    senders: the roles that may publish it; the router lets nobody else.
    """

    name: str
    type: type[m.Message] | None
    rate_hz: float
    quality: Quality
    senders: frozenset[Role]
    plane: Plane = Plane.PRODUCTION
    encoding: str = "application/json"


_DRIVER = frozenset({Role.DRIVER})
_CAMERA = frozenset({Role.CAMERA})
_TARGET = frozenset({Role.TARGET})
_TRACKER = frozenset({Role.TRACKER})
_DIAGNOSIS = frozenset({Role.DIAGNOSIS})
_SUPERVISOR = frozenset({Role.SUPERVISOR})
_CONSOLE = frozenset({Role.CONSOLE})
_SIMULATOR = frozenset({Role.SIM_BRIDGE})
_ORDERING = frozenset({Role.SUPERVISOR, Role.TRACKER, Role.CONSOLE, Role.CLI})
_ANSWERING = frozenset({Role.DRIVER, Role.SUPERVISOR})
_HOST = frozenset({Role.HOST})
_LIAISON = frozenset({Role.LIAISON})

IMU = Topic("imu", m.ImuSample, 25, Quality.SENSOR, _DRIVER)
"""Driver: body rates and specific force of a vehicle."""
ODOMETRY = Topic("odometry", m.Odometry, 100, Quality.SENSOR, _DRIVER)
"""Driver to tracker: velocity, attitude and height as the vehicle measured them."""
OBSERVATION = Topic("observation", m.RelativeObservation, 15, Quality.SENSOR, _CAMERA)
"""Camera or motion capture driver to tracker: a marker that a camera saw, or a body that was captured."""
RANGE = Topic("range", m.RangeObservation, 10, Quality.SENSOR, _CAMERA)
"""Ranging driver to tracker: one robot's distances to the anchors."""
REPORTED_MOTION = Topic("reported_motion", m.ReportedMotion, 20, Quality.SENSOR, _TARGET)
"""Driver of a target's odometry to tracker: the motion that it reports."""
SEARCHED_PICTURE = Topic("searched_picture", m.SearchedPicture, 2, Quality.SENSOR, _CAMERA)
"""Camera driver to tracker: a completely searched picture, and the owners of the markers in it."""
BODY_POSES = Topic("body_poses", m.BodyPoses, 30, Quality.SENSOR, _CAMERA)
"""Motion capture driver: the pose of each body in each frame that is used."""
VEHICLE_STATUS = Topic("vehicle_status", m.VehicleStatus, 5, Quality.STATE, _DRIVER)
"""Driver: flight state, battery, link."""
CAMERA_STATUS = Topic("camera_status", m.CameraStatus, 2, Quality.STATE, _CAMERA | _TARGET)
"""Driver of a camera or another sensor: whether pictures (frames, ranges, reports) arrive, and how many were used."""
ESTIMATE = Topic("estimate", m.Estimate, 50, Quality.STATE, _TRACKER)
"""Tracker: mean and covariance of each robot and target, predicted to now."""
BELIEF = Topic("belief", m.Belief, 5, Quality.STATE, _TRACKER)
"""Tracker: the whole joint belief."""
SEARCH_MAP = Topic("search_map", m.SearchMap, 2, Quality.STATE, _TRACKER)
"""Tracker: where a missing target may be."""
SETPOINT = Topic("setpoint", m.VelocitySetpoint, 50, Quality.CONTROL, _TRACKER)
"""Tracker to driver: velocity of one drone."""
COMMAND = Topic("command", m.Command, 0, Quality.CONTROL, _ORDERING)
"""Operator, any shell or tracker to drivers: a discrete request."""
# Three answers of one turn do not fit the short queue of setpoints: the last, EFFECTIVE, would be dropped.
COMMAND_ACK = Topic("command_ack", m.CommandAck, 0, Quality.SENSOR, _ANSWERING)
"""Driver: how far a command has come."""
LEASE = Topic("lease", m.Lease, 2, Quality.CONTROL, _SUPERVISOR)
"""Operator to drivers: who may start and resume."""
PLAN = Topic("plan", m.Plan, 10, Quality.STATE, _TRACKER)
"""Tracker: the plan that was adopted, with its alternatives."""
INNOVATION = Topic("innovation", m.Innovation, 60, Quality.STATE, _TRACKER)
"""Tracker: the result of each observation."""
SUSPICION = Topic("suspicion", m.Suspicion, 0.2, Quality.STATE, _DIAGNOSIS)
"""Diagnosis to tracker and operator: which figures of the field are suspected."""
EVENT = Topic("event", m.Event, 0, Quality.STATE, PROCESSES)
"""Any process: something that the operator should know."""
PROCESS_STATUS = Topic("process_status", m.ProcessStatus, 1, Quality.STATE, PROCESSES)
"""Every process and the supervisor: lifecycle, CPU, deadlines."""
PREFLIGHT = Topic("preflight", m.Preflight, 0.3, Quality.STATE, _SUPERVISOR)
"""Operator: what the checks before a take-off find, while nobody flies."""
CLOCK = Topic("clock", m.ClockOffset, 1, Quality.STATE, _HOST)
"""Another host: offset of its clock to that of the run."""
HOST_ORDER = Topic("host_order", m.HostOrder, 0, Quality.STATE, _LIAISON)
"""Liaison to another host: the run, and the field with that host's devices."""
HOST_REPORT = Topic("host_report", m.HostReport, 20, Quality.SENSOR, _HOST)
"""Another host to its liaison: its state and its clock."""
HOST_ANSWER = Topic("host_answer", m.HostAnswer, 20, Quality.SENSOR, _LIAISON)
"""Liaison to another host: state of the run's supervisor, and the run's clock."""
JOURNAL = Topic("journal", m.JournalEntry, 50, Quality.BULK, _TRACKER)
"""Tracker: inputs and adopted plan of each tick."""
IMAGE = Topic("image", None, 5, Quality.BULK, _CAMERA, encoding="image/jpeg")
"""Camera driver: single pictures for the console."""
VIDEO = Topic("video", None, 30, Quality.BULK, _CAMERA, encoding="video/h264")
"""Camera driver: every access unit of an H.264 camera, as received."""
RAW_RX = Topic("raw_rx", None, 200, Quality.BULK, _DRIVER, encoding="application/octet-stream")
"""Driver: datagrams received, with their times."""
RAW_TX = Topic("raw_tx", None, 30, Quality.BULK, _DRIVER, encoding="application/octet-stream")
"""Driver: datagrams sent, with their times."""
TRUTH = Topic("state", m.TruthState, 50, Quality.STATE, _SIMULATOR, Plane.TRUTH)
"""Simulator: true state of one body."""
SIM_COMMAND = Topic("drive", m.SimCommand, 0, Quality.CONTROL, _CONSOLE, Plane.SIM)
"""Console or shell to simulator: steer a target."""
SIM_STATUS = Topic("status", m.SimStatus, 1, Quality.STATE, _SIMULATOR, Plane.SIM)
"""Simulator: whether it keeps real time."""

TOPICS: dict[tuple[Plane, str], Topic] = {
    (topic.plane, topic.name): topic
    for topic in (
        IMU,
        ODOMETRY,
        OBSERVATION,
        RANGE,
        REPORTED_MOTION,
        SEARCHED_PICTURE,
        BODY_POSES,
        VEHICLE_STATUS,
        CAMERA_STATUS,
        ESTIMATE,
        BELIEF,
        SEARCH_MAP,
        SETPOINT,
        COMMAND,
        COMMAND_ACK,
        LEASE,
        PLAN,
        INNOVATION,
        SUSPICION,
        EVENT,
        PROCESS_STATUS,
        PREFLIGHT,
        CLOCK,
        HOST_ORDER,
        HOST_REPORT,
        HOST_ANSWER,
        JOURNAL,
        IMAGE,
        VIDEO,
        RAW_RX,
        RAW_TX,
        TRUTH,
        SIM_COMMAND,
        SIM_STATUS,
    )
}

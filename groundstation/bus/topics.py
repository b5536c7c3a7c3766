"""The one table of topics: liveness, freshness, recording and documentation are derived from it."""

from dataclasses import dataclass
from enum import StrEnum

from groundstation.bus import messages as m


class Quality(StrEnum):
    """Delivery classes; all of them drop rather than block."""

    CONTROL = "control"
    SENSOR = "sensor"
    STATE = "state"
    BULK = "bulk"


class Plane(StrEnum):
    """Which key space a topic lives in; production wildcards match neither `@truth` nor `@sim`."""

    PRODUCTION = ""
    TRUTH = "@truth"
    SIM = "@sim"


@dataclass(frozen=True, slots=True)
class Topic:
    """A name on the bus; `type` is None for raw bytes (their `Header` travels as attachment)."""

    name: str
    type: type[m.Message] | None
    rate_hz: float
    quality: Quality
    plane: Plane = Plane.PRODUCTION
    encoding: str = "application/json"


IMU = Topic("imu", m.ImuSample, 200, Quality.SENSOR)
ODOMETRY = Topic("odometry", m.Odometry, 200, Quality.SENSOR)
OBSERVATION = Topic("observation", m.RelativeObservation, 15, Quality.SENSOR)
VEHICLE_STATUS = Topic("vehicle_status", m.VehicleStatus, 5, Quality.STATE)
CAMERA_STATUS = Topic("camera_status", m.CameraStatus, 2, Quality.STATE)
ESTIMATE = Topic("estimate", m.Estimate, 50, Quality.STATE)
BELIEF = Topic("belief", m.Belief, 5, Quality.STATE)
SETPOINT = Topic("setpoint", m.VelocitySetpoint, 50, Quality.CONTROL)
COMMAND = Topic("command", m.Command, 0, Quality.CONTROL)
COMMAND_ACK = Topic("command_ack", m.CommandAck, 0, Quality.CONTROL)
LEASE = Topic("lease", m.Lease, 2, Quality.CONTROL)
PLAN = Topic("plan", m.Plan, 10, Quality.STATE)
INNOVATION = Topic("innovation", m.Innovation, 60, Quality.STATE)
EVENT = Topic("event", m.Event, 0, Quality.STATE)
PROCESS_STATUS = Topic("process_status", m.ProcessStatus, 1, Quality.STATE)
CLOCK = Topic("clock", m.ClockOffset, 1, Quality.STATE)
JOURNAL = Topic("journal", m.JournalEntry, 50, Quality.BULK)
IMAGE = Topic("image", None, 5, Quality.BULK, encoding="image/jpeg")
VIDEO = Topic("video", None, 30, Quality.BULK, encoding="video/h264")
RAW_RX = Topic("raw_rx", None, 200, Quality.BULK, encoding="application/octet-stream")
RAW_TX = Topic("raw_tx", None, 30, Quality.BULK, encoding="application/octet-stream")
TRUTH = Topic("state", m.TruthState, 50, Quality.STATE, Plane.TRUTH)
SIM_COMMAND = Topic("drive", m.SimCommand, 0, Quality.CONTROL, Plane.SIM)
SIM_STATUS = Topic("status", m.SimStatus, 1, Quality.STATE, Plane.SIM)

TOPICS: dict[tuple[Plane, str], Topic] = {
    (topic.plane, topic.name): topic
    for topic in (
        IMU,
        ODOMETRY,
        OBSERVATION,
        VEHICLE_STATUS,
        CAMERA_STATUS,
        ESTIMATE,
        BELIEF,
        SETPOINT,
        COMMAND,
        COMMAND_ACK,
        LEASE,
        PLAN,
        INNOVATION,
        EVENT,
        PROCESS_STATUS,
        CLOCK,
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

"""Messages that fly a vehicle, field by field in the order of the dialect."""

from typing import NamedTuple

from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT, MavCmd

Floats = tuple[float, ...]


class SetPositionTargetLocalNed(NamedTuple):
    """A setpoint; a set bit of type_mask means: ignore this field.

    WIRE (docs/reference/mavlink.md 5.1): frame 8 rotates the velocity by the current heading; both accept 1 and 8 only.
    """

    time_boot_ms: int
    target_system: int
    target_component: int
    coordinate_frame: int
    type_mask: int
    x: float
    y: float
    z: float
    vx: float
    vy: float
    vz: float
    afx: float
    afy: float
    afz: float
    yaw: float
    yaw_rate: float


class SetPositionTargetGlobalInt(NamedTuple):
    """A setpoint at a place on Earth [deg x 1e7, m], with velocities as those of SetPositionTargetLocalNed."""

    time_boot_ms: int
    target_system: int
    target_component: int
    coordinate_frame: int
    type_mask: int
    lat_int: int
    lon_int: int
    alt: float
    vx: float
    vy: float
    vz: float
    afx: float
    afy: float
    afz: float
    yaw: float
    yaw_rate: float


class VisionPositionEstimate(NamedTuple):
    """A pose measured from outside: NED [m], roll pitch yaw [rad], upper triangle of its covariance (6, 6)."""

    usec: int
    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float
    covariance: Floats
    reset_counter: int


class OdometryMessage(NamedTuple):
    """Pose in frame_id, velocity and rates in child_frame_id; q is frame from child, w x y z.

    WIRE (docs/reference/mavlink.md 5.5): covariances are upper triangles, a first element NaN means unknown. PX4 sends
    child frame 1 (velocity in NED) and takes 1 or 12; ArduPilot never sends it and takes frame 20 with child 12 only.
    """

    time_usec: int
    frame_id: int
    child_frame_id: int
    x: float
    y: float
    z: float
    q: Floats
    vx: float
    vy: float
    vz: float
    rollspeed: float
    pitchspeed: float
    yawspeed: float
    pose_covariance: Floats
    velocity_covariance: Floats
    reset_counter: int = 0
    estimator_type: int = 0
    quality: int = 0


class CommandLong(NamedTuple):
    """A request that is acknowledged."""

    target_system: int
    target_component: int
    command: int
    confirmation: int
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    param5: float = 0.0
    param6: float = 0.0
    param7: float = 0.0


def command_to(system: int, command: MavCmd, *params: float) -> CommandLong:
    """Return a request to a system's autopilot, sent for the first time."""
    return CommandLong(system, AUTOPILOT_COMPONENT, command, 0, *params)


class CommandInt(NamedTuple):
    """A request with a position; acknowledged like CommandLong."""

    target_system: int
    target_component: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float


class CommandAckMessage(NamedTuple):
    """The answer to a command."""

    command: int
    result: int
    progress: int = 0
    result_param2: int = 0
    target_system: int = 0
    target_component: int = 0


class MissionItem(NamedTuple):
    """A point of a mission; current: 2 and 3 make an ArduPilot in GUIDED go there, or change its height, at once."""

    target_system: int
    target_component: int
    seq: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: float
    y: float
    z: float
    mission_type: int = 0


class MissionItemInt(NamedTuple):
    """The same with latitude and longitude in 1e-7 degrees."""

    target_system: int
    target_component: int
    seq: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float
    mission_type: int = 0


class SetMode(NamedTuple):
    """The old way to change the mode (pymavlink, MAVProxy)."""

    target_system: int
    base_mode: int
    custom_mode: int

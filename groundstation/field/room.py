"""The room, its fence, the cameras fixed in it, and lens calibrations."""

import datetime
from typing import Literal

import msgspec

from groundstation.vectors import Bounds, Interval, Vector2, Vector3

# A person sets a drone on its cross to a centimetre; a drone farther off stands somewhere else [m].
OFF_PAD_M = 0.25
# A place by ranges also has the lasting part of their errors, times the dilution by the anchors' geometry.
_DILUTED_SIGMAS = 4.0


class Fence(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Box that drones must not leave [m; world]."""

    x_m: Interval
    y_m: Interval
    z_m: Interval

    @property
    def bounds_m(self) -> Bounds:
        """Return its bounds along x, y and z [m; world]."""
        return self.x_m, self.y_m, self.z_m


class RoomObstacle(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An upright box that stands on the floor along the room's axes: its centre and size [m; world]."""

    centre_m: Vector2
    size_m: Vector3


class Room(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Size along x, y, z (origin on the floor in the middle), the fence, and obstacles by name."""

    size_m: Vector3
    fence: Fence
    obstacles: dict[str, RoomObstacle] = {}


class LensStd(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Standard deviations of a calibration's figures."""

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    k1: float
    k2: float
    p1: float
    p2: float
    k3: float


class LensCalibration(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A pinhole with distortion k1, k2, p1, p2, k3."""

    schema_version: Literal[1] = 1
    model: Literal["plumb_bob"]
    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float]
    residual_px: float = 0.2
    date: datetime.date | None = None
    views: int | None = None
    std: LensStd | None = None

    @property
    def focal_std(self) -> float:
        """Return the deviation of its focal length as a share; 0 if the file does not state it."""
        if self.std is None:
            return 0.0
        return max(self.std.fx_px / self.fx_px, self.std.fy_px / self.fy_px)


class WorldCamera(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A camera fixed in the world [m; world]; rotation_deg turns it about the world's axes from looking down."""

    source: str
    calibration: LensCalibration
    position_m: Vector3
    host: str = ""
    looking: Literal["down"] = "down"
    rotation_deg: Vector3 = (0.0, 0.0, 0.0)
    video_delay_ms: float = 120.0
    readout_ms: float = 0.0
    attitude_std_deg: float = 0.2
    position_std_m: float = 0.01
    observes: tuple[Literal["robots", "targets"], ...] = ("robots",)


class RigidBody(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A motion capture system's name of the body on an entity ("": the entity's), and its origin and heading there."""

    name: str = ""
    position_m: Vector3 = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0


class Volume(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The box in which a motion capture system sees bodies [m; world]."""

    x_m: Interval
    y_m: Interval
    z_m: Interval


class Transponder(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A ranging system's name of the transponder on a robot ("": the robot's), and its place [m; base]."""

    name: str = ""
    position_m: Vector3 = (0.0, 0.0, 0.0)


class Ranging(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A ranging system: its anchors' places [m; world], its volume, and its deviations."""

    source: str
    anchors: dict[str, Vector3]
    volume_m: Volume
    host: str = ""
    transponders: dict[str, Transponder] = {}
    rate_hz: float = 10.0
    delay_ms: float = 20.0
    range_std_m: float = 0.08
    bias_std_m: float = 0.05
    outlier_share: float = 0.02
    reach_m: float = 30.0
    pad_heading_std_deg: float = 10.0

    def transponder(self, robot: str) -> Transponder:
        """Return the transponder of a robot; without an entry it has the robot's name and place."""
        return self.transponders.get(robot, Transponder())

    @property
    def pad_limit_m(self) -> float:
        """Return the distance from its pad from which on a robot stands elsewhere [m]: lasting errors count."""
        return OFF_PAD_M + _DILUTED_SIGMAS * self.bias_std_m


def ranging_link(system: str, anchor: str, robot: str) -> str:
    """Return the estimator's name of the pair of an anchor and a robot, for their ranges and bias."""
    return f"{system}_{anchor}_{robot}"


class MotionCapture(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A motion capture system, fixed in the world: place [m; world] and heading of its axes, bodies, deviations."""

    source: str
    volume_m: Volume
    host: str = ""
    bodies: dict[str, RigidBody] = {}
    observes: tuple[Literal["robots", "targets"], ...] = ("robots",)
    up: Literal["y", "z"] = "z"
    position_m: Vector3 = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    delay_ms: float = 5.0
    rate_hz: float = 30.0
    pose_std_m: float = 0.003
    heading_std_deg: float = 1.0
    attitude_std_deg: float = 0.1
    position_std_m: float = 0.005

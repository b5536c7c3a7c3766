"""The part of a resolved field from which the simulator builds its room.

The field's full model belongs to the settings of the ground station; a simulator that read all of it would break with
every new key, so what is not named here is ignored.
"""

import math
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from groundstation.errors import SettingsError
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.tag import SquareTag
from sim_bridge.scenario import describe_problems


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class SimulatedObstacle(_Part):
    """An upright box that stands on the floor along the room's axes."""

    centre_m: tuple[float, float]
    size_m: tuple[float, float, float]


class SimulatedRoom(_Part):
    """Size along x, y, z (origin on the floor in the middle), and obstacles by name."""

    size_m: tuple[float, float, float]
    obstacles: dict[str, SimulatedObstacle] = {}


class LensStd(_Part):
    """Standard deviations of a lens's figures."""

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    k1: float
    k2: float
    p1: float
    p2: float
    k3: float


class Lens(_Part):
    """Pinhole with plumb-bob distortion k1 k2 p1 p2 k3, and standard deviations of its figures, if given."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float]
    std: LensStd | None = None

    @property
    def intrinsics(self) -> CameraIntrinsics:
        """Return the lens model."""
        return CameraIntrinsics(
            self.width_px, self.height_px, self.fx_px, self.fy_px, self.cx_px, self.cy_px, self.distortion
        )


class MarkerPrint(_Part):
    """The print of a marker: a checkerboard, or (kind aruco) a tag."""

    kind: Literal["checkerboard", "aruco"] = "checkerboard"
    code: int | None = None
    square_mm: float = 44.0
    dictionary: str | None = None
    id: int | None = None
    size_mm: float | None = None

    @property
    def printed(self) -> Checkerboard | SquareTag:
        """Return the marker's layout."""
        if self.dictionary is not None and self.id is not None and self.size_mm is not None:
            return SquareTag(self.dictionary, self.id, self.size_mm)
        return Checkerboard(-1 if self.code is None else self.code, self.square_mm)


class MarkerOfDrone(MarkerPrint):
    """The marker of a drone."""

    position_m: tuple[float, float, float]


class EmulatedCamera(_Part):
    """A drone's camera [base]; source: the address of its pictures, which also determines their transport."""

    source: str = ""
    calibration: Lens
    position_m: tuple[float, float, float]
    tilt_down_deg: float
    pan_left_deg: float = 0.0
    attitude_std_deg: float = 0.0
    position_std_m: float = 0.0


class SiteDrone(_Part):
    """One drone: kind, place and heading of its pad, camera, marker; sections of its kind are kept unread."""

    model_config = ConfigDict(frozen=True, extra="allow", allow_inf_nan=False)

    kind: str
    pad_m: tuple[float, float]
    pad_yaw_deg: float = 0.0
    marker: MarkerOfDrone
    camera: EmulatedCamera | None = None

    @property
    def pad_yaw_rad(self) -> float:
        """Return the heading on the pad [rad; world]."""
        return math.radians(self.pad_yaw_deg)

    def section(self, key: str) -> dict[str, Any]:
        """Return the section that only its kind has; empty if it is not given."""
        extra = self.model_extra or {}
        return extra.get(key) or extra.get("sections", {}).get(key) or {}


class SiteCamera(_Part):
    """A camera fixed in the world, looking down but for a turn: roll, pitch, yaw about the world's axes."""

    calibration: Lens
    position_m: tuple[float, float, float]
    attitude_std_deg: float = 0.0
    position_std_m: float = 0.0
    looking: Literal["down"] = "down"
    rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    observes: tuple[str, ...] = ("robots",)


class SiteBody(_Part):
    """A rigid body of a motion capture system on an entity."""

    name: str = ""
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0


class SiteVolume(_Part):
    """The box in which a motion capture system sees bodies."""

    x_m: tuple[float, float]
    y_m: tuple[float, float]
    z_m: tuple[float, float]


class SiteCapture(_Part):
    """A motion capture system: protocol, origin and heading of its axes in the world, vertical axis, bodies, noise."""

    source: str = ""
    volume_m: SiteVolume
    bodies: dict[str, SiteBody] = {}
    up: Literal["y", "z"] = "z"
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    delay_ms: float = 5.0
    pose_std_m: float = 0.003
    heading_std_deg: float = 1.0
    attitude_std_deg: float = 0.0
    position_std_m: float = 0.0
    rate_hz: float = 30.0
    observes: tuple[str, ...] = ("robots",)


class SiteTransponder(_Part):
    """A transponder of a ranging system on a drone."""

    name: str = ""
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


class SiteRanging(_Part):
    """A ranging system: anchors in the world, transponders on drones, noise, and the share of ranges by reflections."""

    anchors: dict[str, tuple[float, float, float]]
    volume_m: SiteVolume
    transponders: dict[str, SiteTransponder] = {}
    rate_hz: float = 10.0
    delay_ms: float = 20.0
    range_std_m: float = 0.08
    bias_std_m: float = 0.05
    outlier_share: float = 0.02
    reach_m: float = 30.0


class TargetMarker(MarkerPrint):
    """The marker of the target, flat, `height_m` above the floor."""

    height_m: float


class SiteOdometry(_Part):
    """The odometry that a target publishes; `source` has its topic and domain."""

    source: str
    delay_ms: float = 20.0
    speed_std_m_s: float = 0.05


class SiteTarget(_Part):
    """A TurtleBot."""

    marker: TargetMarker
    odometry: SiteOdometry | None = None


class SingleTarget(SiteTarget):
    """The only target, with its name."""

    name: str


class Site(_Part):
    """Room, drones, cameras of a resolved field, and its target or, by name, its targets."""

    site: str
    room: SimulatedRoom
    cameras: dict[str, SiteCamera] = {}
    motion_capture: dict[str, SiteCapture] = {}
    ranging: dict[str, SiteRanging] = {}
    truth: dict[str, str] = {}
    drones: dict[str, SiteDrone]
    target: SingleTarget | None = None
    targets: dict[str, SiteTarget] = {}

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.target is None) == (not self.targets):
            raise ValueError("needs either a target or targets")
        return self

    @property
    def tracked(self) -> dict[str, SiteTarget]:
        """Return the targets by name."""
        return dict(self.targets) if self.target is None else {self.target.name: self.target}

    @property
    def bodies(self) -> tuple[str, ...]:
        """Return the names of all moving bodies: drones in the field's order, then the targets."""
        return (*self.drones, *self.tracked)


def parse_site(field: object) -> Site:
    """Return the simulator's view of a resolved field (decoded JSON); raises SettingsError with all problems."""
    try:
        return Site.model_validate(field)
    except ValidationError as error:
        raise SettingsError(describe_problems("field", error)) from None

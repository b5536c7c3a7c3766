"""The room: its size, its fence, the cameras fixed in it, and what a lens calibration says."""

import datetime
import math
from typing import Annotated, Literal

from pydantic import Field

from groundstation.settings.values import Interval, Section, Source, Vector3, VideoDelay, of_length

Length = Annotated[float, Field(gt=0, le=100)]
Angle = Annotated[float, Field(ge=-180, le=180)]


class Fence(Section):
    """Box that drones are stopped in before they leave it [m; world]."""

    x_m: Interval
    y_m: Interval
    z_m: Interval

    def contains(self, x_m: float, y_m: float) -> bool:
        """Return whether a point of the floor lies inside."""
        return self.x_m[0] <= x_m <= self.x_m[1] and self.y_m[0] <= y_m <= self.y_m[1]


class Room(Section):
    """Size along x, y, z (origin on the floor, in the middle) and the fence in it."""

    size_m: Annotated[tuple[Length, Length, Length], of_length(3)]
    fence: Fence


Rotation = Annotated[tuple[Angle, Angle, Angle], of_length(3)]
LensStd = Annotated[float, Field(ge=0)]


class CalibrationStd(Section):
    """One sigma of each figure of a calibration, as its least squares have it."""

    fx_px: LensStd
    fy_px: LensStd
    cx_px: LensStd
    cy_px: LensStd
    k1: LensStd
    k2: LensStd
    p1: LensStd
    p2: LensStd
    k3: LensStd


class Calibration(Section):
    """Pinhole with radial and tangential distortion (OpenCV's plumb bob), as measured on one camera.

    views: pictures that it was measured with.
    """

    schema_version: Literal[1] = 1
    model: Literal["plumb_bob"]
    width_px: Annotated[int, Field(ge=16, le=8192)]
    height_px: Annotated[int, Field(ge=16, le=8192)]
    fx_px: Annotated[float, Field(gt=0, le=100_000)]
    fy_px: Annotated[float, Field(gt=0, le=100_000)]
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float]
    residual_px: Annotated[float, Field(gt=0, le=5)] = 0.2
    date: datetime.date | None = None
    views: Annotated[int, Field(gt=0)] | None = None
    std: CalibrationStd | None = None

    @property
    def horizontal_view_rad(self) -> float:
        """Return the horizontal angle of view, without distortion."""
        return 2 * math.atan(self.width_px / (2 * self.fx_px))

    @property
    def vertical_view_rad(self) -> float:
        """Return the vertical angle of view, without distortion."""
        return 2 * math.atan(self.height_px / (2 * self.fy_px))


class WorldCamera(Section):
    """A camera fixed in the world. `looking: down`: picture right is world x, picture down is world -y.

    rotation_deg: how it is turned from there, roll, pitch, yaw about the world's axes, as it was measured.
    """

    source: Source
    calibration: Calibration
    position_m: Vector3
    looking: Literal["down"] = "down"
    rotation_deg: Rotation = (0.0, 0.0, 0.0)
    video_delay_ms: VideoDelay = 120.0
    attitude_std_deg: Annotated[float, Field(gt=0, le=10)] = 0.2
    position_std_m: Annotated[float, Field(gt=0, le=0.5)] = 0.01
    observes: Annotated[tuple[Literal["robots", "targets"], ...], Field(min_length=1)] = ("robots",)

    @property
    def attitude_std_rad(self) -> float:
        """Return how well the mounting's attitude is known [rad]."""
        return math.radians(self.attitude_std_deg)

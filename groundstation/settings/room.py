"""Settings of the room, its fence, the cameras fixed in it, and lens calibrations."""

import datetime
import math
from typing import Annotated, Literal

from pydantic import Field

from groundstation.settings.values import (
    HostName,
    Interval,
    Name,
    Readout,
    SettingsSection,
    Source,
    Vector2,
    Vector3,
    VideoDelay,
    of_length,
)

LONGEST_M = 100.0
"""Longest side of a room."""
Length = Annotated[float, Field(gt=0, le=LONGEST_M)]
Angle = Annotated[float, Field(ge=-180, le=180)]


class FenceSettings(SettingsSection):
    """Box that drones are stopped before they leave [m; world]."""

    x_m: Interval
    """Lower and upper limit along x [m; world]."""
    y_m: Interval
    """Lower and upper limit along y [m; world]."""
    z_m: Interval
    """Lower and upper limit of the height [m; world]."""

    def contains(self, x_m: float, y_m: float) -> bool:
        """Return whether a point of the floor lies inside."""
        return self.x_m[0] <= x_m <= self.x_m[1] and self.y_m[0] <= y_m <= self.y_m[1]


class ObstacleSettings(SettingsSection):
    """An upright box along the room's axes that hides what is behind it: a cupboard, a pillar, a table."""

    centre_m: Vector2
    """Where its middle stands on the floor [x, y in m; world]."""
    size_m: Annotated[tuple[Length, Length, Length], of_length(3)]
    """Its size along world x, y and z [m]; it stands on the floor."""


class RoomSettings(SettingsSection):
    """The room: its size, the fence in it, and what stands there."""

    size_m: Annotated[tuple[Length, Length, Length], of_length(3)]
    """Size of the room along x, y and z [m]. The origin is on the floor, in the middle."""
    fence: FenceSettings
    """Box inside the room that drones are not allowed to leave."""
    obstacles: dict[Name, ObstacleSettings] = Field(default_factory=dict)
    """What stands in the room and hides markers, by name. Plans look past it; drones fly round or over it."""

    @property
    def inside(self) -> dict[str, Interval]:
        """Return the room's interval along each axis [m; world], by the name that fences and volumes give it."""
        x, y, z = self.size_m
        return {"x_m": (-x / 2, x / 2), "y_m": (-y / 2, y / 2), "z_m": (0.0, z)}


Rotation = Annotated[tuple[Angle, Angle, Angle], of_length(3)]
LensStd = Annotated[float, Field(ge=0)]


class CalibrationStd(SettingsSection):
    """Standard deviations of a calibration, from its least-squares fit."""

    fx_px: LensStd
    """Standard deviation of fx_px [px]."""
    fy_px: LensStd
    """Standard deviation of fy_px [px]."""
    cx_px: LensStd
    """Standard deviation of cx_px [px]."""
    cy_px: LensStd
    """Standard deviation of cy_px [px]."""
    k1: LensStd
    """Standard deviation of k1."""
    k2: LensStd
    """Standard deviation of k2."""
    p1: LensStd
    """Standard deviation of p1."""
    p2: LensStd
    """Standard deviation of p2."""
    k3: LensStd
    """Standard deviation of k3."""


class CalibrationSettings(SettingsSection):
    """A lens calibration: pinhole with radial and tangential distortion (OpenCV's plumb bob)."""

    schema_version: Literal[1] = 1
    """Version of the file format."""
    model: Literal["plumb_bob"]
    """Lens model: pinhole with radial and tangential distortion."""
    width_px: Annotated[int, Field(ge=16, le=8192)]
    """Width [px] of the pictures that the calibration belongs to."""
    height_px: Annotated[int, Field(ge=16, le=8192)]
    """Height [px] of the pictures that the calibration belongs to."""
    fx_px: Annotated[float, Field(gt=0, le=100_000)]
    """Focal length along the image's x axis [px]."""
    fy_px: Annotated[float, Field(gt=0, le=100_000)]
    """Focal length along the image's y axis [px]; nearly fx_px."""
    cx_px: float
    """Principal point, x [px]; the centre of the first pixel is 0."""
    cy_px: float
    """Principal point, y [px]; the centre of the first pixel is 0."""
    distortion: tuple[float, float, float, float, float]
    """Distortion k1, k2, p1, p2, k3, as OpenCV's calibrateCamera orders them."""
    residual_px: Annotated[float, Field(gt=0, le=5)] = 0.2
    """RMS residual [px] of the calibration. calibrate check and calibrate extrinsics judge by it; flights do not take
    it for noise, since errors of a lens do not average out."""
    date: datetime.date | None = None
    """Day of the measurement (YYYY-MM-DD)."""
    views: Annotated[int, Field(gt=0)] | None = None
    """Number of pictures that the calibration was made from."""
    std: CalibrationStd | None = None
    """Standard deviations of the figures, from the least-squares fit."""

    @property
    def horizontal_view_rad(self) -> float:
        """Return the horizontal angle of view, without distortion."""
        return 2 * math.atan(self.width_px / (2 * self.fx_px))

    @property
    def vertical_view_rad(self) -> float:
        """Return the vertical angle of view, without distortion."""
        return 2 * math.atan(self.height_px / (2 * self.fy_px))


class WorldCameraSettings(SettingsSection):
    """A camera fixed in the world."""

    source: Source
    """Where pictures come from: http://, rtsp:// or ros2:// address, /dev/videoN, video file or folder of pictures."""
    host: HostName = ""
    """Name of the host that the camera's driver runs on, as the site admitted it. Empty: the host of the run."""
    calibration: CalibrationSettings
    """Lens calibration: the name of a file beside the field file, or its content."""
    position_m: Vector3
    """Optical centre [m; world], inside the room and above the fence."""
    looking: Literal["down"] = "down"
    """Orientation before rotation_deg. down: the image's right is world x, the image's bottom is world -y."""
    rotation_deg: Rotation = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw [deg] about the world's axes from that orientation. groundstation calibrate extrinsics measures
    them."""
    video_delay_ms: VideoDelay = 120.0
    """Median time [ms] from the exposure of a picture to its arrival. Measure it: groundstation calibrate delay."""
    readout_ms: Readout = 0.0
    """Time [ms] from the exposure of a picture's first row to that of its last (rolling shutter), as its data sheet has
    it: a marker's time is that of its row; 0: all at once. A picture's own time is that of its middle row."""
    attitude_std_deg: Annotated[float, Field(gt=0, le=10)] = 0.2
    """Standard deviation [deg] of the mounting angles."""
    position_std_m: Annotated[float, Field(gt=0, le=0.5)] = 0.01
    """Standard deviation [m] of the position."""
    observes: Annotated[tuple[Literal["robots", "targets"], ...], Field(min_length=1)] = ("robots",)
    """What the camera may report. Fixed cameras observe robots only unless this says otherwise: tracking the target is
    the team's task."""

    @property
    def attitude_std_rad(self) -> float:
        """Return the standard deviation of the mounting's attitude [rad]."""
        return math.radians(self.attitude_std_deg)

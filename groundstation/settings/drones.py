"""One drone: how it is reached, what it may do, what it carries, how well it measures itself."""

import math
from typing import Annotated, Literal

from pydantic import Field

from groundstation.settings.marker import Marker
from groundstation.settings.room import Calibration
from groundstation.settings.values import Address, OnVehicle, Section, Source, Vector2, VideoDelay

StdDeviation = Annotated[float, Field(gt=0, le=10)]
Delay = Annotated[float, Field(ge=0, le=1000)]


class Limits(Section):
    """What a drone is never asked to exceed; battery_min is a share of 1."""

    max_speed_m_s: Annotated[float, Field(gt=0, le=3)] = 0.6
    max_climb_m_s: Annotated[float, Field(gt=0, le=1.5)] = 0.4
    max_yaw_rate_deg_s: Annotated[float, Field(gt=0, le=180)] = 60.0
    max_tilt_deg: Annotated[float, Field(ge=3, le=25)] = 12.0
    battery_min: Annotated[float, Field(ge=0.05, le=0.9)] = 0.15
    battery_hold_s: Annotated[float, Field(ge=0, le=30)] = 3.0

    @property
    def max_yaw_rate_rad_s(self) -> float:
        """Return the largest turn rate [rad/s]."""
        return math.radians(self.max_yaw_rate_deg_s)

    @property
    def max_tilt_rad(self) -> float:
        """Return the largest tilt [rad]."""
        return math.radians(self.max_tilt_deg)


class RobotMarker(Marker):
    """The marker flat on top of a drone, and where its centre is [base]."""

    position_m: OnVehicle = (0.0, 0.0, 0.08)


class OnboardCamera(Section):
    """The camera of a drone: where it sits [base], tilted down from the horizon, panned left."""

    source: Source
    calibration: Calibration
    position_m: OnVehicle = (0.0, 0.0, 0.0)
    tilt_down_deg: Annotated[float, Field(ge=-90, le=90)] = 45.0
    pan_left_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    video_delay_ms: VideoDelay = 120.0

    @property
    def tilt_down_rad(self) -> float:
        """Return the tilt below the horizon [rad]."""
        return math.radians(self.tilt_down_deg)

    @property
    def pan_left_rad(self) -> float:
        """Return the pan to the left [rad]."""
        return math.radians(self.pan_left_deg)


class OdometryCalibration(Section):
    """Figures measured on this kind of vehicle: true velocity = scale x reported velocity; one sigma; delays."""

    velocity_scale: Annotated[float, Field(ge=0.2, le=5)] = 1.0
    velocity_std_m_s: StdDeviation = 0.05
    velocity_delay_ms: Delay = 30.0
    height_std_m: StdDeviation = 0.04
    height_delay_ms: Delay = 85.0
    attitude_std_deg: StdDeviation = 1.0
    yaw_rate_std_deg_s: StdDeviation = 1.0

    @property
    def attitude_std_rad(self) -> float:
        """Return the error of roll and pitch [rad]."""
        return math.radians(self.attitude_std_deg)


class ArDroneVideo(Section):
    """What an AR.Drone is told to send over TCP 5555; bitrate [kbit/s], none: the drone's own choice."""

    codec: Literal["h264_360p", "h264_720p"] = "h264_360p"
    channel: Literal["front", "bottom"] = "front"
    bitrate: Annotated[int, Field(ge=250, le=4000)] | None = None


class Mavlink(Section):
    """How a MAVLink vehicle is met: PX4 or ArduPilot, its system id, and the way to it.

    Over UDP to address:port, which is spoken to first; with `listen`, vehicles call local_address:port instead, many on
    one port; with `serial`, `DEVICE:BAUD`. key_file: signed links only (link: pymavlink).
    """

    flavour: Literal["px4", "ardupilot"]
    system_id: Annotated[int, Field(ge=1, le=250)]
    link: Literal["pymavlink", "mavsdk"] = "pymavlink"
    port: Annotated[int, Field(ge=1024, le=65535)] = 14550
    listen: bool = False
    local_address: Address = "0.0.0.0"
    serial: Annotated[str, Field(pattern=r"^(/dev/[^:]+:\d+)?$")] = ""
    key_file: str = ""
    take_off_m: Annotated[float, Field(ge=0.4, le=3)] = 0.8
    vision_hz: Annotated[float, Field(ge=5, le=50)] = 30.0


class Drone(Section):
    """One drone with all three levels merged. `pad_m` is where it takes off, `pad_yaw_deg` how it stands there."""

    kind: Literal["ardrone", "mavlink"]
    mavlink: Mavlink | None = None
    video: ArDroneVideo | None = None
    enabled: bool = True
    address: Address
    limits: Limits = Limits()
    marker: RobotMarker
    camera: OnboardCamera
    odometry: OdometryCalibration = OdometryCalibration()
    pad_m: Vector2
    pad_yaw_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0

    @property
    def pad_yaw_rad(self) -> float:
        """Return the heading on the pad [rad; world]."""
        return math.radians(self.pad_yaw_deg)

"""A drone: limits, marker, camera, errors of its own sensors, link."""

from typing import Literal

import msgspec

from groundstation.field.room import LensCalibration, Vector2, Vector3
from groundstation.field.targets import DroneMarker


def camera_name(drone: str) -> str:
    """Return the name on the bus of the camera that a drone carries."""
    return f"{drone}_camera"


class DroneLimits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a drone is never commanded to exceed, and when its battery makes it land."""

    max_speed_m_s: float = 0.6
    max_climb_m_s: float = 0.4
    max_yaw_rate_deg_s: float = 60.0
    max_tilt_deg: float = 12.0
    battery_min: float = 0.15
    battery_hold_s: float = 3.0


class OnboardCamera(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The camera that a drone carries [m; base]."""

    source: str
    calibration: LensCalibration
    position_m: Vector3 = (0.0, 0.0, 0.0)
    tilt_down_deg: float = 45.0
    pan_left_deg: float = 0.0
    video_delay_ms: float = 120.0


class OdometryErrors(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Errors and delays of the vehicle's own sensors; deviations are one sigma."""

    velocity_scale: float = 1.0
    velocity_std_m_s: float = 0.05
    velocity_delay_ms: float = 30.0
    height_std_m: float = 0.04
    height_delay_ms: float = 85.0
    attitude_std_deg: float = 1.0
    yaw_rate_std_deg_s: float = 1.0


class VideoChoice(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Video settings that are written to an AR.Drone."""

    codec: Literal["h264_360p", "h264_720p"] = "h264_360p"
    channel: Literal["front", "bottom"] = "front"
    bitrate: int | None = None


class MavlinkLink(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A MAVLink vehicle and the link to it."""

    flavour: Literal["px4", "ardupilot"]
    system_id: int
    link: Literal["pymavlink", "mavsdk"] = "pymavlink"
    port: int = 14550
    listen: bool = False
    local_address: str = "0.0.0.0"
    serial: str = ""
    key_file: str = ""
    take_off_m: float = 0.8
    vision_hz: float = 30.0
    parameters: dict[str, float] = {}
    forward: str = ""
    forward_allows: tuple[Literal["parameters", "missions"], ...] = ()


class FieldDrone(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One drone of the team; pad_m, pad_yaw_deg: where it takes off [world]."""

    kind: Literal["ardrone", "mavlink"]
    mavlink: MavlinkLink | None = None
    video: VideoChoice | None = None
    enabled: bool = True
    address: str
    serial_number: str = ""
    limits: DroneLimits = DroneLimits()
    marker: DroneMarker
    camera: OnboardCamera
    odometry: OdometryErrors = OdometryErrors()
    pad_m: Vector2
    pad_yaw_deg: float = 0.0

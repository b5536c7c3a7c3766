"""A drone: limits, marker, camera, errors of its own sensors, link."""

import math
from typing import Any

import msgspec

from groundstation.field.room import LensCalibration
from groundstation.field.targets import DroneMarker
from groundstation.vectors import Vector2, Vector3


def camera_name(drone: str) -> str:
    """Return the name on the bus of the camera that a drone carries."""
    return f"{drone}_camera"


class DroneLimits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Limits of a drone's commands; charge (0..1) below which it may not start, and lands after battery_hold_s."""

    max_speed_m_s: float = 0.6
    max_climb_m_s: float = 0.4
    max_yaw_rate_deg_s: float = 60.0
    max_tilt_deg: float = 12.0
    battery_min: float = 0.15
    battery_hold_s: float = 3.0


class OnboardCamera(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The camera that a drone carries [m; base]; the deviations are those of its mounting."""

    source: str
    calibration: LensCalibration
    position_m: Vector3 = (0.0, 0.0, 0.0)
    tilt_down_deg: float = 45.0
    pan_left_deg: float = 0.0
    attitude_std_deg: float = 0.0
    position_std_m: float = 0.0
    video_delay_ms: float = 120.0
    readout_ms: float = 0.0


class OdometryErrors(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Errors and delays of the vehicle's own sensors; deviations are one sigma."""

    velocity_scale: float = 1.0
    velocity_std_m_s: float = 0.05
    velocity_delay_ms: float = 30.0
    height_std_m: float = 0.04
    height_delay_ms: float = 85.0
    attitude_std_deg: float = 1.0
    yaw_rate_std_deg_s: float = 1.0

    @property
    def attitude_std_rad(self) -> float:
        """Return the error of roll and pitch [rad]."""
        return math.radians(self.attitude_std_deg)


class FieldDrone(msgspec.Struct, frozen=True, kw_only=True):
    """One drone of the team; pad_m, pad_yaw_deg: its take-off place and heading [world].

    sections: those that only its kind has, by key, unread; its driver and its emulator read them. In a
    drone decoded without `gathered`, as in processes that do not need them, they are left out.
    """

    kind: str
    enabled: bool = True
    address: str
    interface: str = ""
    host: str = ""
    serial_number: str = ""
    limits: DroneLimits = DroneLimits()
    marker: DroneMarker
    camera: OnboardCamera
    odometry: OdometryErrors = OdometryErrors()
    pad_m: Vector2
    pad_yaw_deg: float = 0.0
    sections: dict[str, Any] = {}

    @property
    def pad_yaw_rad(self) -> float:
        """Return the heading on the pad [rad; world]."""
        return math.radians(self.pad_yaw_deg)


_COMMON = frozenset(FieldDrone.__struct_fields__)


def drone_from_values(values: Any) -> FieldDrone:
    """Return a drone from decoded JSON; raises msgspec.ValidationError that names the key at fault."""
    return msgspec.convert(gathered(values), FieldDrone)


def gathered(values: Any) -> Any:
    """Return a drone's values with the sections of its kind gathered under one key."""
    if not isinstance(values, dict):
        return values
    common = {key: value for key, value in values.items() if key in _COMMON}
    own = {key: value for key, value in values.items() if key not in _COMMON}
    return {**common, "sections": {**own, **common.get("sections", {})}}

"""Limits and time-outs that every vehicle driver has; the kinds add their own."""

import ipaddress
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from drivers.watchdog_types import WatchdogLimits
from groundstation.field.behaviour import SafetyValues
from groundstation.field.drones import DroneLimits
from groundstation.vectors import Bounds, Vector3
from groundstation.vehicles import DriverProcess, VehicleOrder

_SAFETY = SafetyValues()

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Port = Annotated[int, Field(ge=1, le=65535)]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,47}$")]


def is_address(value: str) -> str:
    """Return an IPv4 address unchanged; raises pydantic's error for any other text."""
    try:
        ipaddress.IPv4Address(value)
    except ValueError:
        raise PydanticCustomError("address", "must be an IPv4 address such as 192.168.1.11") from None
    return value


Address = Annotated[str, AfterValidator(is_address)]


@dataclass(frozen=True, slots=True)
class Shape:
    """Annotation of text of one pattern: the words say what it must be, and the JSON schema has the pattern."""

    pattern: str
    words: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self._checked, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {**handler(schema), "pattern": self.pattern}

    def _checked(self, value: str) -> str:
        if re.fullmatch(self.pattern, value) is None:
            raise PydanticCustomError("shape", "{words}", {"words": self.words})
        return value


class DriverSection(BaseModel):
    """A part of a driver's settings: closed, immutable, finite."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class VehicleLimits(DriverSection):
    """Limits that no command to a vehicle exceeds."""

    max_speed_m_s: Positive = 0.6
    max_climb_m_s: Annotated[float, Field(gt=0, le=2)] = 0.4
    max_yaw_rate_deg_s: Annotated[float, Field(gt=0, le=350)] = 60.0
    battery_min: Annotated[float, Field(ge=0, le=1)] = 0.15
    battery_hold_s: NotNegative = 3.0

    @property
    def max_yaw_rate_rad_s(self) -> float:
        """Return the largest turn rate [rad/s]."""
        return math.radians(self.max_yaw_rate_deg_s)

    def within(self, velocity_m_s: Vector3, yaw_rate_rad_s: float) -> tuple[Vector3, float]:
        """Return a velocity [base_stabilized] and a turn rate within the limits; one too fast keeps its direction."""
        forward, left, up = velocity_m_s
        share = min(1.0, self.max_speed_m_s / max(math.hypot(forward, left), 1e-9))
        rise = max(-self.max_climb_m_s, min(self.max_climb_m_s, up))
        fastest = self.max_yaw_rate_rad_s
        return (share * forward, share * left, rise), max(-fastest, min(fastest, yaw_rate_rad_s))


class SilenceLimits(DriverSection):
    """Communication time-outs, the separation of drones, and their fence.

    setpoint_lifetime_ms caps the lifetime that a setpoint may claim. fence_m: low and high along x, y and z [m; world];
    None: unknown, then none of them is outside.
    """

    setpoint_lifetime_ms: Annotated[int, Field(ge=100, le=500)] = _SAFETY.setpoint_lifetime_ms
    land_after_s: Annotated[float, Field(ge=0.5, le=30)] = _SAFETY.land_after_s
    unseen_land_after_s: Annotated[float, Field(ge=1, le=60)] = _SAFETY.unseen_land_after_s
    min_separation_m: Positive = 0.6
    fence_m: Bounds | None = None

    def authority(self, limits: VehicleLimits, pad_m: tuple[float, float] | None = None) -> WatchdogLimits:
        """Return the limits of the shared watchdog for a vehicle with these limits; pad_m: where it takes off."""
        return WatchdogLimits(
            hover_after_s=self.setpoint_lifetime_ms / 1000,
            land_after_s=self.land_after_s,
            unseen_land_after_s=self.unseen_land_after_s,
            battery_min=limits.battery_min,
            battery_hold_s=limits.battery_hold_s,
            max_speed_m_s=limits.max_speed_m_s,
            max_climb_m_s=limits.max_climb_m_s,
            pad_m=pad_m,
            min_separation_m=self.min_separation_m,
            fence_m=self.fence_m,
        )


def silence_limits(order: VehicleOrder) -> SilenceLimits:
    """Return the silence limits of a field's safety section, and its fence."""
    safety = order.safety
    return SilenceLimits(
        setpoint_lifetime_ms=safety.setpoint_lifetime_ms,
        land_after_s=safety.land_after_s,
        unseen_land_after_s=safety.unseen_land_after_s,
        min_separation_m=safety.min_separation_m,
        fence_m=None if order.fence is None else order.fence.bounds_m,
    )


def vehicle_limits(limits: DroneLimits) -> VehicleLimits:
    """Return a field's limits for a drone of any kind."""
    return VehicleLimits(
        max_speed_m_s=limits.max_speed_m_s,
        max_climb_m_s=limits.max_climb_m_s,
        max_yaw_rate_deg_s=limits.max_yaw_rate_deg_s,
        battery_min=limits.battery_min,
        battery_hold_s=limits.battery_hold_s,
    )


class VehicleDriverSettings(DriverSection):
    """The settings of the driver of one vehicle of any kind; a kind adds its own.

    interface: network adapter that the vehicle is behind ("": any); pad_m: where it takes off [x, y; world], None:
    unknown; velocity_scale: true velocity / reported velocity; raw_datagrams: whether they are recorded.
    """

    name: Name
    address: str
    interface: str = ""
    pad_m: tuple[float, float] | None = None
    limits: VehicleLimits = VehicleLimits()
    safety: SilenceLimits = SilenceLimits()
    velocity_scale: Positive = 1.0
    velocity_std_m_s: Positive = 0.05
    raw_datagrams: bool = True

    @property
    def authority(self) -> WatchdogLimits:
        """Return the limits of the shared watchdog."""
        return self.safety.authority(self.limits, self.pad_m)


def values_of(order: VehicleOrder) -> dict[str, Any]:
    """Return the values of VehicleDriverSettings for one drone of a field."""
    drone = order.drone
    return {
        "name": order.name,
        "address": drone.address,
        "interface": drone.interface,
        "pad_m": drone.pad_m,
        "limits": vehicle_limits(drone.limits),
        "safety": silence_limits(order),
        "velocity_scale": drone.odometry.velocity_scale,
        "velocity_std_m_s": drone.odometry.velocity_std_m_s,
        "raw_datagrams": order.raw_datagrams,
    }


def a_process_each(
    settings_of: Callable[[VehicleOrder], BaseModel],
) -> Callable[[Sequence[VehicleOrder]], list[DriverProcess]]:
    """Return a function that gives each vehicle a driver process of its own; settings_of: that process's settings."""
    return lambda orders: [DriverProcess((order.name,), settings_of(order).model_dump_json()) for order in orders]

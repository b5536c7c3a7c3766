"""Settings of the MAVLink driver; the composition root fills them from the field file."""

from dataclasses import replace
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from drivers.vehicle_settings import DriverSection, Name, Positive, Shape, SilenceLimits, VehicleLimits, is_address
from drivers.watchdog_types import WatchdogLimits

# Faster than any flight of this kind [m/s]: beyond it a reported velocity is no measurement.
FASTEST_M_S = 8.0
_LIMITS = WatchdogLimits()


def _is_reachable(forward: str) -> str:
    if forward:
        _, address, port = forward.split(":")
        is_address(address)
        if not 1 <= int(port) <= 65535:
            raise PydanticCustomError("port", "must end in a port from 1 to 65535")
    return forward


_FORWARD = Shape(r"^(udp:\d{1,3}(\.\d{1,3}){3}:\d{1,5})?$", "must be udp:ADDRESS:PORT, such as udp:127.0.0.1:14550")
_PARAMETER = Shape(r"^[A-Z][A-Z0-9_]{0,15}$", "must be a parameter's name (A-Z first, then A-Z, 0-9, _; 16 at most)")
_TARGET = Shape(
    r"^(udpout|udpin|serial):[^:]+:\d{1,7}$",
    "must be like udpin:0.0.0.0:14550, udpout:ADDRESS:PORT, serial:DEVICE:BAUD",
)
ParameterName = Annotated[str, _PARAMETER]
Forward = Annotated[str, _FORWARD, AfterValidator(_is_reachable)]
"""Where a second ground station listens, such as udp:127.0.0.1:14550; empty: nowhere."""


def _has_a_port(target: str) -> str:
    way, _, number = target.split(":")
    least = int(way == "udpout")  # udpin with port 0 waits at any free one
    if way != "serial" and not least <= int(number) <= 65535:
        raise PydanticCustomError("port", "must end in a port from 1 to 65535")
    return target


class VisionFeedback(DriverSection):
    """Poses sent to the autopilot from the tracker's estimate, and the effect of their loss.

    rate_hz: of the messages; max_std_m: a less certain position is not sent (without sightings it is so after about a
    second); max_age_s: nor is that of a vehicle not seen itself for so long; hover_after_s, land_after_s: without any
    pose; jump_m: distance beyond that which it can have flown.
    """

    rate_hz: Annotated[float, Field(ge=5, le=50)] = 30.0
    max_std_m: Positive = 0.07
    max_age_s: Positive = 10.0
    hover_after_s: Positive = _LIMITS.lost_hover_s
    land_after_s: Positive = _LIMITS.lost_land_s
    jump_m: Positive = 0.3

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.land_after_s <= self.hover_after_s:
            raise ValueError("land_after_s must be longer than hover_after_s")
        return self


class GlobalOrigin(DriverSection):
    """Position on Earth given to the estimator; any place will do indoors.

    altitude_m: of the floor. Another than 0 shifts the local height of a PX4 by as much.
    """

    latitude_deg: Annotated[float, Field(ge=-85, le=85)] = 47.397742
    longitude_deg: Annotated[float, Field(ge=-180, le=180)] = 8.545594
    altitude_m: Annotated[float, Field(ge=-500, le=9000)] = 0.0


class LinkSettings(DriverSection):
    """How a port is reached.

    target: `udpout:ADDRESS:PORT` sends first; `udpin:ADDRESS:PORT` waits there, for many vehicles at once;
    `serial:DEVICE:BAUD`. ADDRESS%ADAPTER: through that network adapter only. key_file: 32 bytes, raw or as 64 hex
    digits; then only signed frames count (pymavlink alone).
    """

    kind: Literal["pymavlink", "mavsdk"] = "pymavlink"
    target: Annotated[str, _TARGET, AfterValidator(_has_a_port)]
    system_id: Annotated[int, Field(ge=1, le=255)] = 255
    component_id: Annotated[int, Field(ge=1, le=255)] = 190
    key_file: str = ""

    @model_validator(mode="after")
    def _signable(self) -> Self:
        if self.key_file and self.kind == "mavsdk":
            raise ValueError("MAVSDK cannot sign: use link: pymavlink for a signed link")
        return self


class VehicleSettings(DriverSection):
    """One vehicle on the link: identity, pad [world], limits.

    serial_number: of the only vehicle that may take off ("": any).
    """

    name: Name
    system_id: Annotated[int, Field(ge=1, le=250)]
    flavour: Literal["px4", "ardupilot"]
    serial_number: str = ""
    pad_m: tuple[float, float] = (0.0, 0.0)
    pad_yaw_rad: float = 0.0
    limits: VehicleLimits = VehicleLimits()
    take_off_m: Annotated[float, Field(ge=0.4, le=3)] = 0.8
    odometry_hz: Annotated[float, Field(gt=0, le=100)] = 50.0
    imu_hz: Annotated[float, Field(ge=0, le=200)] = 25.0  # for recordings, and to detect stuck values
    setpoint_hz: Annotated[float, Field(ge=5, le=50)] = 20.0
    velocity_std_m_s: Positive = 0.15
    attitude_std_rad: Positive = 0.0053
    parameters: dict[ParameterName, float] = Field(default={})
    forward: Forward = ""
    forward_allows: tuple[Literal["parameters", "missions"], ...] = ()


class MavlinkDriverSettings(DriverSection):
    """One port and the vehicles behind it."""

    link: LinkSettings
    vehicles: Annotated[tuple[VehicleSettings, ...], Field(min_length=1)]
    safety: SilenceLimits = SilenceLimits()
    vision: VisionFeedback = VisionFeedback()
    origin: GlobalOrigin = GlobalOrigin()
    raw_datagrams: bool = True

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        for what in ("name", "system_id"):
            values = [getattr(vehicle, what) for vehicle in self.vehicles]
            if len(set(values)) < len(values):
                raise ValueError(f"two vehicles on {self.link.target} have the same {what}")
        return self

    def authority(self, vehicle: VehicleSettings) -> WatchdogLimits:
        """Return the limits of one vehicle's watchdog."""
        limits, vision = self.safety.authority(vehicle.limits, vehicle.pad_m), self.vision
        return replace(limits, lost_hover_s=vision.hover_after_s, lost_land_s=vision.land_after_s)

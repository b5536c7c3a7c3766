"""What the AR.Drone driver is told; the composition root fills it from the field file."""

import math
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from drivers.authority import AuthorityLimits

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Port = Annotated[int, Field(ge=1, le=65535)]


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Limits(_Section):
    """What the vehicle is never asked to exceed; written to its configuration as well."""

    max_speed_m_s: Positive = 0.6
    max_climb_m_s: Annotated[float, Field(gt=0, le=2)] = 0.4
    max_yaw_rate_deg_s: Annotated[float, Field(gt=0, le=350)] = 60.0
    max_tilt_deg: Annotated[float, Field(ge=3, le=29)] = 12.0
    battery_min: Annotated[float, Field(ge=0, le=1)] = 0.15
    battery_hold_s: NotNegative = 3.0

    @property
    def max_yaw_rate_rad_s(self) -> float:
        """Return the largest turn rate [rad/s]."""
        return math.radians(self.max_yaw_rate_deg_s)

    @property
    def max_tilt_rad(self) -> float:
        """Return the largest tilt [rad]."""
        return math.radians(self.max_tilt_deg)


class OdometryCalibration(_Section):
    """True velocity = scale x reported velocity; one sigma of it. Delays and the rest concern the estimator alone."""

    velocity_scale: Annotated[float, Field(ge=0.2, le=5)] = 1.0
    velocity_std_m_s: Positive = 0.05


class Safety(_Section):
    """How long silence is borne; setpoint_lifetime_ms caps the lifetime that a setpoint may claim."""

    setpoint_lifetime_ms: Annotated[int, Field(ge=100, le=1000)] = 300
    land_after_s: Annotated[float, Field(ge=0.5, le=30)] = 3.0
    unseen_land_after_s: Annotated[float, Field(ge=1, le=60)] = 10.0


class Flight(_Section):
    """Flight configuration of the drone itself; two drones near each other need different ultrasound rates (7, 8)."""

    altitude_max_m: Annotated[float, Field(ge=0.5, le=100)] = 3.0
    outdoor: bool = False
    without_shell: bool = False
    ultrasound_freq: Literal[7, 8] = 8
    flat_trim: bool = True


class ArDroneDriverSettings(_Section):
    """One AR.Drone: where it is, what it may do, what is published of it.

    local_address: address to bind (empty: any); ports are the drone's, ours are ephemeral.
    """

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,47}$")]
    address: str
    navdata_port: Port = 5554
    at_port: Port = 5556
    local_address: str = ""
    limits: Limits = Limits()
    odometry: OdometryCalibration = OdometryCalibration()
    safety: Safety = Safety()
    flight: Flight = Flight()
    odometry_hz: Annotated[float, Field(gt=0, le=200)] = 100.0
    imu_hz: Annotated[float, Field(ge=0, le=200)] = 100.0
    raw_datagrams: bool = True
    strict_checksum: bool = True

    @property
    def authority(self) -> AuthorityLimits:
        """Return the limits of the shared watchdog."""
        return AuthorityLimits(
            hover_after_s=self.safety.setpoint_lifetime_ms / 1000,
            land_after_s=self.safety.land_after_s,
            unseen_land_after_s=self.safety.unseen_land_after_s,
            battery_min=self.limits.battery_min,
            battery_hold_s=self.limits.battery_hold_s,
        )

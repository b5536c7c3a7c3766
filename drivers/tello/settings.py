"""Settings of a Tello: its section of the field file, and its driver's section."""

from typing import Annotated

from pydantic import Field

from drivers.vehicle_settings import Address, VehicleDriverSettings
from groundstation.vehicles import KindSection

# Faster than any flight of this kind [m/s]: beyond it a reported velocity is no measurement.
FASTEST_M_S = 5.0


class TelloSection(KindSection):
    """A Tello or RoboMaster TT in SDK mode."""

    local_address: Address = "0.0.0.0"
    """IPv4 address of this computer at which the state is received (UDP 8890)."""
    video: bool = True
    """Ask it for the pictures of its own camera (`camera.source: tello://ADDRESS`), over and over while it stands."""
    full_speed_m_s: Annotated[float, Field(gt=0, le=8)] = 1.0
    """Horizontal speed [m/s] at full stick."""
    full_climb_m_s: Annotated[float, Field(gt=0, le=4)] = 1.0
    """Climb rate [m/s] at full stick."""
    full_yaw_rate_deg_s: Annotated[float, Field(gt=0, le=360)] = 100.0
    """Turn rate [deg/s] at full stick."""


class TelloDriverSettings(VehicleDriverSettings):
    """One Tello."""

    tello: TelloSection = TelloSection()

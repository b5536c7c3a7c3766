"""Settings of the AR.Drone driver; the composition root fills them from the field file."""

import math
from typing import Annotated, Literal

from pydantic import Field

from drivers.vehicle_settings import DriverSection, Port, VehicleDriverSettings, VehicleLimits

VideoCodec = Literal["h264_360p", "h264_720p"]

# Faster than any flight of this kind [m/s]: beyond it a reported velocity is no measurement.
FASTEST_M_S = 5.0


class ArDroneLimits(VehicleLimits):
    """Limits that no command exceeds; also written to the drone's configuration."""

    max_tilt_deg: Annotated[float, Field(ge=3, le=29)] = 12.0

    @property
    def max_tilt_rad(self) -> float:
        """Return the largest tilt [rad]."""
        return math.radians(self.max_tilt_deg)


class FlightConfiguration(DriverSection):
    """Flight configuration of the drone itself; two drones near each other need different ultrasound rates (7, 8)."""

    altitude_max_m: Annotated[float, Field(ge=0.5, le=100)] = 3.0
    outdoor: bool = False
    without_shell: bool = False
    ultrasound_freq: Literal[7, 8] = 8
    flat_trim: bool = True


class Video(DriverSection):
    """The video that the drone sends over TCP 5555 to any client; bitrate [kbit/s], constant; none: the drone's own."""

    codec: VideoCodec = "h264_360p"
    channel: Literal["front", "bottom"] = "front"
    bitrate: Annotated[int, Field(ge=250, le=4000)] | None = None


class ArDroneDriverSettings(VehicleDriverSettings):
    """One AR.Drone: address, limits, published data.

    local_address: address to bind (empty: any); local_navdata_port, local_at_port: ports to bind there, 0: any free
    one, so that many drones fit on one host. video None: the drone's own setting is left alone. serial_number: the only
    drone that may take off ("": any).
    """

    serial_number: str = ""
    navdata_port: Port = 5554
    at_port: Port = 5556
    control_port: Port = 5559
    ftp_port: Port = 5551
    local_navdata_port: Annotated[int, Field(ge=0, le=65535)] = 0
    local_at_port: Annotated[int, Field(ge=0, le=65535)] = 0
    local_address: str = ""
    limits: ArDroneLimits = ArDroneLimits()
    flight: FlightConfiguration = FlightConfiguration()
    video: Video | None = None
    odometry_hz: Annotated[float, Field(gt=0, le=200)] = 50.0
    imu_hz: Annotated[float, Field(ge=0, le=200)] = 25.0
    strict_checksum: bool = True

"""Settings of the Tello driver."""

from drivers.vehicle_settings import DriverSection, Name, Positive, SilenceLimits, VehicleLimits


class TelloDriverSettings(DriverSection):
    """One Tello: address, limits, and what full sticks mean [m/s, deg/s]. pad_m: where it takes off [x, y; world]."""

    name: Name
    address: str
    interface: str = ""
    local_address: str = "0.0.0.0"
    pad_m: tuple[float, float]
    limits: VehicleLimits = VehicleLimits()
    safety: SilenceLimits = SilenceLimits()
    velocity_scale: Positive = 1.0
    velocity_std_m_s: Positive = 0.05
    full_speed_m_s: Positive = 1.0
    full_climb_m_s: Positive = 1.0
    full_yaw_rate_deg_s: Positive = 100.0
    raw_datagrams: bool = True

"""What supervisor or guardian tell a vehicle for a driver that died or hangs."""

from drivers.mavlink.convert import setpoint_from_velocity
from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.frames import FrameEncoder
from drivers.mavlink.wire.names import MavCmd
from drivers.vehicle_settings import VehicleLimits


def hover_and_land(system: int, our_system: int = 255) -> tuple[bytes, bytes]:
    """Return the datagrams that stop and that land a vehicle; both are obeyed as often as they are repeated."""
    encoder = FrameEncoder(our_system, 190)
    hover = setpoint_from_velocity(system, 0, (0.0, 0.0, 0.0), 0.0, VehicleLimits())
    return encoder.encode(hover), encoder.encode(CommandLong(system, 1, MavCmd.NAV_LAND, 0))

"""From a drone of the site to its emulator."""

from drivers.mavlink.wire.names import Flavour
from sim_bridge.devices.mavlink import MavlinkEmulator
from sim_bridge.order import Order
from sim_bridge.site import SiteDrone
from sim_bridge.world.copter import Copter


def open_vehicle(name: str, drone: SiteDrone, copter: Copter, order: Order) -> MavlinkEmulator:
    """Return the listening emulator of a MAVLink vehicle.

    Where the field's driver waits for its vehicles (`listen`), the vehicle calls it.
    """
    identity = drone.mavlink
    assert identity is not None
    flavour = Flavour.PX4 if identity.flavour == "px4" else Flavour.ARDUPILOT
    video = ""
    if name in order.streams:
        address, port = order.streams[name]
        video = f"http://{address}:{port}/video.mjpg"
    return MavlinkEmulator(
        name,
        (order.addresses[name], identity.port),
        flavour,
        identity.system_id,
        copter,
        configured=order.scenario.mavlink.configured,
        calls=(identity.local_address, identity.port) if identity.listen else None,
        video=video,
    )

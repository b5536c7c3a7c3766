"""The bytes with which supervisor or guardian stop and land a drone whose driver is dead, for each kind of vehicle."""

from drivers.ardrone.wire import at
from groundstation.settings.drones import Mavlink, unknown_kind
from groundstation.settings.schema import Field
from groundstation.settings.sections import DriverSection
from groundstation.supervisor.process_spec import FailsafeDatagrams

_AT_PORT = 5556


def failsafe_datagrams(field: Field, section: DriverSection) -> FailsafeDatagrams | None:
    """Return what a drone is sent, or None where nobody but its driver can speak to it."""
    drone = field.drones[section.entity]
    match drone.kind:
        case "ardrone":
            return _of_ardrone(drone.address, field.safety.land_after_s)
        case "mavlink":
            return _of_mavlink(drone.address, drone.require_mavlink(), field.safety.land_after_s)
        case other:
            raise unknown_kind(other)


def _of_ardrone(address: str, land_after_s: float) -> FailsafeDatagrams:
    # WIRE: sequence number 1 resets the drone's count, so it obeys whoever speaks after its driver. Hovering is PCMD
    # without flags, and no REF: a start bit would lift a drone that stands.
    hover = at.encode_datagram([at.pcmd(at.ProgressiveMotion())], 1)
    land = at.encode_datagram([at.ref(start=False), at.pcmd(at.ProgressiveMotion())], 1)
    return FailsafeDatagrams(address, _AT_PORT, hover, land, land_after_s)


def _of_mavlink(address: str, mavlink: Mavlink, land_after_s: float) -> FailsafeDatagrams | None:
    if mavlink.listen or mavlink.serial or mavlink.key_file:
        return None  # nobody but the driver can speak to it; its own time-outs act
    # Only here: pymavlink's dialect takes its time to load.
    from drivers.mavlink.failsafe import hover_and_land

    hover, land = hover_and_land(mavlink.system_id)
    return FailsafeDatagrams(address, mavlink.port, hover, land, land_after_s)

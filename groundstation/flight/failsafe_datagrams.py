"""The bytes with which supervisor or guardian stop and land a drone whose driver is dead, for each kind of vehicle."""

import json

from drivers.ardrone.wire import at
from drivers.mavlink.settings import MavlinkDriverSettings
from groundstation.settings.drones import Drone, unknown_kind
from groundstation.settings.schema import Field
from groundstation.settings.sections import DriverSection
from groundstation.supervisor.process_spec import FailsafeDatagrams

_AT_PORT = 5556
_VOICE = "drivers.mavlink.voice:MavlinkVoice"


def failsafe_datagrams(field: Field, section: DriverSection) -> FailsafeDatagrams:
    """Return what the vehicles of a driver are sent."""
    drone = field.drones[section.entity]
    match drone.kind:
        case "ardrone":
            return _of_ardrone(drone.address, field.safety.land_after_s)
        case "mavlink":
            return _of_mavlink(drone, section, field.safety.land_after_s)
        case other:
            raise unknown_kind(other)


def _of_ardrone(address: str, land_after_s: float) -> FailsafeDatagrams:
    # WIRE: sequence number 1 resets the drone's count, so it obeys whoever speaks after its driver. Hovering is PCMD
    # without flags, and no REF: a start bit would lift a drone that stands.
    hover = at.encode_datagram([at.pcmd(at.ProgressiveMotion())], 1)
    land = at.encode_datagram([at.ref(start=False), at.pcmd(at.ProgressiveMotion())], 1)
    return FailsafeDatagrams(address, _AT_PORT, hover, land, land_after_s)


def _of_mavlink(drone: Drone, section: DriverSection, land_after_s: float) -> FailsafeDatagrams:
    # Only here: pymavlink's dialect takes its time to load.
    from drivers.mavlink.failsafe import hover_and_land

    mavlink = drone.require_mavlink()
    systems = [vehicle.system_id for vehicle in MavlinkDriverSettings.model_validate_json(section.section).vehicles]
    hover, land = hover_and_land(systems, signed=bool(mavlink.key_file))
    way = json.dumps({"serial": mavlink.serial, "key_file": mavlink.key_file})
    return FailsafeDatagrams(drone.address, mavlink.port, hover, land, land_after_s, _VOICE, way, mavlink.listen)

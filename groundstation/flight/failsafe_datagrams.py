"""The datagrams by which supervisor or guardian stop and land the drones of a dead driver, by their kind."""

from groundstation.settings.schema import Field
from groundstation.settings.sections import DriverSection, vehicle_order
from groundstation.supervisor.process_spec import FailsafeDatagrams
from groundstation.vehicles import kind_named
from groundstation.vehicles.answers import stop_of


def failsafe_datagrams(field: Field, section: DriverSection) -> FailsafeDatagrams:
    """Return the failsafe datagrams for a driver's vehicles."""
    drone = field.drones[section.entity]
    stop = stop_of(kind_named(drone.kind), [vehicle_order(field, name) for name in section.entities])
    # A vehicle that cannot hover for so long without its driver is landed sooner.
    land_after_s = min(field.safety.land_after_s, stop.hovers_s)
    return FailsafeDatagrams(
        drone.address,
        stop.port,
        stop.hover,
        stop.land,
        land_after_s,
        stop.transport,
        stop.way,
        stop.called,
        drone.interface,
    )

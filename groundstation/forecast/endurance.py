"""Flight time of each drone's battery, where its kind states one."""

from dataclasses import dataclass

from groundstation.field.resolved import ResolvedField
from groundstation.vehicles import kind_named


@dataclass(frozen=True, slots=True)
class Endurance:
    """A drone's time in the air from a full battery until it lands [s]; None: its kind states no figure."""

    drone: str
    kind: str
    lands_at: float
    seconds: float | None


def endurance_of(field: ResolvedField) -> list[Endurance]:
    """Return the endurance of each drone."""
    found = []
    for name, drone in field.drones.items():
        whole, lands_at = kind_named(drone.kind).flight_time_s, drone.limits.battery_min
        found.append(Endurance(name, drone.kind, lands_at, None if whole is None else (1.0 - lands_at) * whole))
    return found

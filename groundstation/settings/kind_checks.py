"""Checks of the sections that only one kind of vehicle has."""

from collections.abc import Iterator, Mapping

from groundstation.field.behaviour import SafetyValues
from groundstation.field.drones import drone_from_values
from groundstation.settings.document import KeyPath
from groundstation.settings.drones import Drone
from groundstation.vehicles import VehicleOrder, all_kinds, kind_named
from groundstation.vehicles.registry import ask


def findings_of_kinds(drones: Mapping[str, Drone]) -> Iterator[tuple[KeyPath, str]]:
    """Return sections at drones of another kind, missing sections, and the findings of the kinds on their own."""
    teams: dict[str, list[VehicleOrder]] = {}
    for index, (name, drone) in enumerate(drones.items()):
        yield from _misplaced(name, drone)
        missing = sorted(kind_named(drone.kind).required - set(drone.sections))
        for key in missing:
            yield ("drones", name, key), f"must be given for kind: {drone.kind}"
        if not missing:
            values = drone_from_values(drone.model_dump(mode="json"))
            order = VehicleOrder(name, index, values, SafetyValues(), 0.0, False, drone.sections)
            teams.setdefault(drone.kind, []).append(order)
    for kind, team in teams.items():
        for name, (below, text) in ask(kind_named(kind), "check", team):
            yield ("drones", name, *below), text


def _misplaced(name: str, drone: Drone) -> Iterator[tuple[KeyPath, str]]:
    others = {key for kind in all_kinds().values() if kind.name != drone.kind for key in kind.sections}
    if not kind_named(drone.kind).has_serial_number:
        others.add("serial_number")
    if drone.interface and not kind_named(drone.kind).has_interface:
        yield ("drones", name, "interface"), f"cannot be used: the driver of {drone.kind} does not choose its adapter"
    for key in sorted(others):
        if getattr(drone, key, None):
            yield ("drones", name, key), f"has no meaning for {drone.kind}"

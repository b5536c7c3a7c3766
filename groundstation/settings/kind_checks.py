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
    for name, drone in drones.items():
        yield from _misplaced(name, drone)
        for key in _missing(drone):
            yield ("drones", name, key), f"must be given for kind: {drone.kind}"
    yield from _found_by_kinds("check", drones)


def cautions_of_kinds(drones: Mapping[str, Drone]) -> Iterator[tuple[KeyPath, str]]:
    """Return the warnings of the kinds about their own."""
    yield from _found_by_kinds("cautions", drones)


def _missing(drone: Drone) -> list[str]:
    return sorted(kind_named(drone.kind).required - set(drone.sections))


def _found_by_kinds(part: str, drones: Mapping[str, Drone]) -> Iterator[tuple[KeyPath, str]]:
    teams: dict[str, list[VehicleOrder]] = {}
    for index, (name, drone) in enumerate(drones.items()):
        if not _missing(drone):
            values = drone_from_values(drone.model_dump(mode="json"))
            order = VehicleOrder(name, index, values, SafetyValues(), 0.0, False, drone.sections)
            teams.setdefault(drone.kind, []).append(order)
    for kind, team in teams.items():
        for name, (below, text) in ask(kind_named(kind), part, team):
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

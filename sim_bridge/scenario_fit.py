"""Finds parts of a scenario that do not fit its field: missing entities, and faults that an entity cannot have."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from groundstation.vehicles import kind_named
from sim_bridge.fault_kinds import RULES, Fault, FaultKind, Part
from sim_bridge.scenario import Scenario
from sim_bridge.site import Site, SiteDrone


@dataclass(frozen=True, slots=True)
class Misfit:
    """One misfit: its path in the scenario, and what is wrong."""

    path: tuple[str | int, ...]
    text: str

    def __str__(self) -> str:
        return f"scenario: {'.'.join(map(str, self.path))}: {self.text}"


def misfits(scenario: Scenario, site: Site, cameras: Collection[str], real: Collection[str] = ()) -> list[Misfit]:
    """Return all misfits: entities that the field lacks or that are real; cameras: the emulated ones."""
    found = list(_of_faults(scenario, site, cameras, real))
    for name in sorted(set(scenario.drones.firmware_by_drone) - set(site.drones)):
        path = ("drones", "firmware_by_drone", name)
        found.append(Misfit(path, f"there is no such drone, only {', '.join(site.drones)}"))
    for name in sorted(set(scenario.targets) - set(site.tracked)):
        found.append(Misfit(("targets", name), f"there is no such target, only {', '.join(site.tracked)}"))
    return found


def _of_faults(scenario: Scenario, site: Site, cameras: Collection[str], real: Collection[str]) -> Iterator[Misfit]:
    """Yield faults of an entity that does not exist, is real, or cannot have them."""
    vehicles = {name: drone for name, drone in site.drones.items() if name not in real}
    known = _known(site, vehicles, cameras)
    for number, fault in enumerate(scenario.faults):
        part = RULES[fault.kind].part
        names = _able(vehicles, fault.kind) if part is Part.ABLE_VEHICLE else known[part]
        others = names
        if fault.kind is FaultKind.ANCHOR_FROZEN and fault.entity in site.ranging:
            others = list(site.ranging[fault.entity].anchors)
        for key, name, possible in (("entity", fault.entity, names), ("other", fault.other, others)):
            if name and name not in possible:
                yield Misfit(("faults", number, key), f"{name!r} is none of {', '.join(possible)}")
        if _is_unlike(fault, site):
            text = f"{fault.entity} and {fault.other} are of different kinds"
            yield Misfit(("faults", number, "other"), text)


def _known(site: Site, vehicles: Mapping[str, SiteDrone], cameras: Collection[str]) -> dict[Part, list[str]]:
    return {
        Part.VEHICLE: sorted(vehicles),
        Part.CAMERA: sorted(cameras),
        Part.MARKER: list(site.bodies),
        Part.CAPTURE: sorted(site.motion_capture),
        Part.BODY: list(site.bodies),
        Part.RANGING: sorted(site.ranging),
        Part.TRANSPONDER: list(site.drones) if site.ranging else [],
        Part.ODOMETRY: [name for name, target in site.tracked.items() if target.odometry is not None],
    }


def _able(vehicles: Mapping[str, SiteDrone], kind: FaultKind) -> list[str]:
    return sorted(name for name, drone in vehicles.items() if kind in kind_named(drone.kind).emulated_faults)


def _is_unlike(fault: Fault, site: Site) -> bool:
    kinds = {site.drones[name].kind for name in (fault.entity, fault.other) if name in site.drones}
    return fault.kind is FaultKind.IDS_SWAPPED and len(kinds) > 1

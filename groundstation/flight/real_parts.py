"""The real parts of a simulated run (`--real drone_2=autopilot:19410`, `--real ceiling`), and their requirements."""

import ipaddress
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from dataclasses import field as of_class

from groundstation.errors import OperatorMistake
from groundstation.field.drones import camera_name
from groundstation.settings.schema import Field
from groundstation.vehicles import all_kinds, kind_named

AUTOPILOT, ESTIMATE, NONE, CAPTURE = "autopilot", "estimate", "none", "capture"
_LOOPBACK = "127.0.0.1"


@dataclass(frozen=True, slots=True)
class RealBody:
    """A real drone or target; source: provider of its place; address: to which its firmware's simulator sends it.

    system: the motion capture system that follows it.
    """

    source: str
    address: tuple[str, int] | None = None
    system: str = ""


@dataclass(frozen=True, slots=True)
class RealParts:
    """The parts of a field that are not emulated: drones and targets by name, cameras by the names of their streams.

    A world-fixed camera has its own name, one that a drone carries the drone's. systems: of motion capture and ranging.
    """

    drones: Mapping[str, RealBody] = of_class(default_factory=dict)
    cameras: frozenset[str] = frozenset()
    targets: frozenset[str] = frozenset()
    systems: frozenset[str] = frozenset()

    @property
    def bodies(self) -> dict[str, RealBody]:
        """Return the real drones and targets; targets have no provider of their place."""
        return {**self.drones, **{name: RealBody(NONE) for name in sorted(self.targets)}}

    @property
    def names(self) -> tuple[str, ...]:
        """Return everything that is real, drones first."""
        return (*self.drones, *sorted(self.targets), *sorted(self.cameras - set(self.drones)), *sorted(self.systems))


ALL_EMULATED = RealParts()


def parse_real(field: Field, options: Iterable[str]) -> RealParts:
    """Return the parts that `--real` names; raises OperatorMistake for unknown, contradictory or unsafe ones."""
    drones: dict[str, RealBody] = {}
    cameras: set[str] = set()
    targets: set[str] = set()
    systems: set[str] = set()
    carried = {camera_name(name): name for name in field.drones}
    for option in options:
        name, equals, source = option.partition("=")
        if name in field.drones:
            drones[name] = _body(field, name, source if equals else ESTIMATE)
        elif equals:
            raise OperatorMistake(f"--real {option}: only a drone has a source of its pose")
        elif name in carried:
            cameras.add(carried[name])
        elif name in field.cameras:
            cameras.add(name)
        elif name in field.tracked:
            targets.add(name)
        elif name in field.volumes:
            systems.add(name)
        else:
            known = ", ".join((*field.drones, *field.cameras, *field.volumes, *carried, *field.tracked))
            raise OperatorMistake(f"--real {name}: the field has no such part, only {known}")
    systems |= {body.system for body in drones.values() if body.system}
    parts = RealParts(drones, frozenset(cameras), frozenset(targets), frozenset(systems))
    _require_sense(field, parts)
    return parts


def _body(field: Field, name: str, source: str) -> RealBody:
    kind, _, place = source.partition(":")
    if kind == ESTIMATE and not place:
        return RealBody(ESTIMATE)
    if kind in field.motion_capture and not place:
        return RealBody(CAPTURE, system=kind)
    if kind == AUTOPILOT:
        if not kind_named(field.drones[name].kind).true_pose:
            told = ", ".join(kind.name for kind in all_kinds().values() if kind.true_pose)
            raise OperatorMistake(f"--real {name}={source}: only simulators of firmware tell a true pose ({told})")
        return RealBody(AUTOPILOT, _address(name, source, place))
    raise OperatorMistake(
        f"--real {name}={source}: the source of its pose is autopilot:PORT (the port on which the simulator behind its "
        "firmware tells the truth), estimate, or the name of a motion capture system of the field"
    )


def _address(name: str, source: str, place: str) -> tuple[str, int]:
    host, _, port = place.rpartition(":")
    try:
        ipaddress.IPv4Address(host or _LOOPBACK)
        number = int(port)
        if not 0 < number < 65536:
            raise ValueError(port)
    except ValueError:
        raise OperatorMistake(f"--real {name}={source}: {place or 'nothing'!r} is no PORT or ADDRESS:PORT") from None
    return host or _LOOPBACK, number


def _require_sense(field: Field, parts: RealParts) -> None:
    """Refuse runs that would be unsafe, or show nothing: with OperatorMistake."""
    _require_places(field, parts)
    for name in sorted(parts.cameras - set(field.cameras) - set(parts.drones)):
        raise OperatorMistake(f"--real {camera_name(name)}: {name}, which carries it, must be real as well")
    if parts.targets and not parts.cameras | parts.systems:
        raise OperatorMistake(f"--real {min(parts.targets)}: no sensor is real, so nothing can see it")
    addresses = [body.address for body in parts.drones.values() if body.address is not None]
    if len(set(addresses)) < len(addresses):
        raise OperatorMistake("--real: two drones have the same port for their true pose")
    if _is_everything(field, parts):
        raise OperatorMistake("--real: nothing is left to emulate; use: groundstation fly")


def _is_everything(field: Field, parts: RealParts) -> bool:
    return (
        len(parts.drones) == len(field.drones)
        and parts.cameras >= {*field.cameras, *field.drones}
        and parts.systems >= set(field.volumes)
        and len(parts.targets) == len(field.tracked)
    )


def _require_places(field: Field, parts: RealParts) -> None:
    """Refuse a real drone whose place nothing real measures."""
    fixed = parts.cameras & set(field.cameras) | parts.systems - set(field.truth.values())
    for name, body in parts.drones.items():
        if body.source == ESTIMATE and not fixed:
            # A fence judged by emulated cameras alone is useless: they would show the drone at its estimated place.
            sensor = next(iter((*field.cameras, *field.volumes)))
            raise OperatorMistake(
                f"--real {name}: nothing real says where it is, so nothing would hold it inside of the fence: make a "
                f"camera or system that sees it real as well (--real {sensor}), or, if the simulator of its "
                f"firmware flies it, name the port of its true pose (--real {name}=autopilot:PORT)"
            )


def notes(field: Field, parts: RealParts) -> list[str]:
    """Return notes on a mixed run for the operator, a sentence each."""
    lines = []
    emulated = [name for name in field.drones if name not in parts.drones]
    for name, body in parts.drones.items():
        if body.source == ESTIMATE:
            lines.append(
                f"{name} is real, and the room takes it to be where the tracker says: emulated cameras do not show it, "
                "so they cannot correct that; only real ones can"
            )
        elif body.address is not None:
            place = f"{body.address[0]}:{body.address[1]}"
            lines.append(f"{name} is real; its true pose is taken from {place} and begins on its pad")
        elif body.system:
            lines.append(f"{name} is real; the room has it where {body.system} sees its body")
    if emulated and (fixed := sorted(parts.cameras & set(field.cameras) | parts.systems)):
        who = " and ".join(fixed)
        lines.append(f"{who} is real and does not see what is emulated: {', '.join(emulated)}")
    if emulated and set(field.cameras) <= parts.cameras and set(field.volumes) <= parts.systems:
        lines.append(
            "nothing that is fixed in the world is emulated: unless they see each other or markers on the floor, "
            "emulated drones are not seen by any camera, and land"
        )
    return lines

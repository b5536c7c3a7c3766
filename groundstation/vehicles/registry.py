"""Finds the kinds of vehicles: ours by their place, those of others by entry point."""

import pkgutil
from collections.abc import Callable, Iterator
from functools import cache
from importlib.util import find_spec
from typing import Any

from groundstation import plug_ins
from groundstation.errors import SettingsError
from groundstation.vehicles.kind import ErrorHabits, KindSection, VehicleKind

_OURS = "drivers"


def kind_named(name: str) -> VehicleKind:
    """Return a kind of vehicle; raises SettingsError naming all kinds, or the reason why this one is refused."""
    kinds, refused = _found()
    if name in kinds:
        return kinds[name]
    if name in refused:
        raise SettingsError([f"kind: {name} cannot be used: {refused[name]}"])
    raise SettingsError([f"kind: {name} is not known; known: {', '.join(kinds)}{plug_ins.damage()}"])


def all_kinds() -> dict[str, VehicleKind]:
    """Return all kinds that could be loaded, by name."""
    return dict(_found()[0])


def refused_kinds() -> dict[str, str]:
    """Return why plug-ins could not be loaded, by the name of their entry point."""
    return dict(_found()[1])


@cache
def _found() -> tuple[dict[str, VehicleKind], dict[str, str]]:
    kinds: dict[str, VehicleKind] = {}
    several = plug_ins.doubles(plug_ins.VEHICLES)
    refused = {name: f"{who} have the same name: uninstall all but one" for name, who in several.items()}
    for name, source, get in (*_ours(), *_of_others()):
        if name in several and name not in kinds:
            continue
        try:
            kinds[name] = _sound(name, get(), kinds)
        except (Exception, SystemExit) as error:  # noqa: BLE001 - anybody's program: its failure is told, ours goes on
            refused[name] = f"{source}: {plug_ins.reason(error)}"
    return kinds, refused


def ask(kind: VehicleKind, part: str, *arguments: object) -> Any:
    """Return the result of a kind's function, an iterator's items as a list; raises SettingsError if it fails."""
    try:
        answer = getattr(kind, part)(*arguments)
        return list(answer) if isinstance(answer, Iterator) else answer
    except SettingsError:
        raise
    except (Exception, SystemExit) as error:
        raise SettingsError([f"kind: {kind.name}: {part} fails: {plug_ins.reason(error)}"]) from error


def _ours() -> Iterator[tuple[str, str, Callable[[], object]]]:
    # By place, not by entry point: those are written when the program is installed, and a checkout is not.
    spec = find_spec(_OURS)
    for package in pkgutil.iter_modules(spec.submodule_search_locations if spec is not None else None):
        module = f"{_OURS}.{package.name}.kind"
        if package.ispkg and find_spec(module) is not None:
            yield package.name, module, lambda module=module: pkgutil.resolve_name(f"{module}:KIND")  # type: ignore[misc]


def _of_others() -> Iterator[tuple[str, str, Callable[[], object]]]:
    for name, source, entry in plug_ins.entries(plug_ins.VEHICLES):
        yield name, source, entry.load


def _sound(name: str, kind: object, known: dict[str, VehicleKind]) -> VehicleKind:
    if not isinstance(kind, VehicleKind):
        raise TypeError(f"is of type {type(kind).__name__}, no groundstation.vehicles.VehicleKind")
    if kind.name != name:
        raise ValueError(f"calls itself {kind.name}: the entry point and the kind must have the same name")
    if name in known:
        raise ValueError("there is a kind of this name already")
    _require_parts(kind)
    taken = {key: other.name for other in known.values() for key in other.sections}
    taken |= {f"{key} of a scenario": other.name for other in known.values() for key in other.scenario}
    for key in (*kind.sections, *(f"{key} of a scenario" for key in kind.scenario)):
        if key in taken:
            raise ValueError(f"its section {key} is that of {taken[key]}")
    return kind


def _require_parts(kind: VehicleKind) -> None:
    if not isinstance(kind.habits, ErrorHabits):
        raise TypeError(f"habits are a {type(kind.habits).__name__}, no ErrorHabits")
    for part in ("processes", "stop", "check", "cautions", "moved"):
        if not callable(getattr(kind, part)):
            raise TypeError(f"{part} is a {type(getattr(kind, part)).__name__}, no function")
    for part in ("driver", "emulator", "true_pose", "blink"):
        place = getattr(kind, part)
        if (place or part == "driver") and ":" not in str(place):
            raise ValueError(f'{part} must be "module:attribute" (got {place!r})')
    for key, section in kind.sections.items():
        if not (isinstance(section, type) and issubclass(section, KindSection)):
            raise TypeError(f"its section {key} is no class derived from KindSection")
    if lost := sorted(kind.required - set(kind.sections)):
        raise ValueError(f"it requires {', '.join(lost)}, which are no sections of it")

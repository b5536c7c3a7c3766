"""Which kinds of vehicles there are: ours by their place, those of others by entry point."""

import pkgutil
from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from groundstation import plug_ins
from groundstation.errors import SettingsError
from groundstation.vehicles.kind import VehicleKind

_OURS = "drivers"


def kind_named(name: str) -> VehicleKind:
    """Return a kind of vehicle; raises SettingsError naming the kinds there are, or why this one is refused."""
    kinds, refused = _found()
    if name in kinds:
        return kinds[name]
    if name in refused:
        raise SettingsError([f"kind: {name} cannot be used: {refused[name]}"])
    raise SettingsError([f"kind: {name} is not known; known: {', '.join(kinds)}"])


def all_kinds() -> dict[str, VehicleKind]:
    """Return all kinds that could be loaded, by name."""
    return dict(_found()[0])


def refused_kinds() -> dict[str, str]:
    """Return why plug-ins could not be loaded, by the name of their entry point."""
    return dict(_found()[1])


def load(reference: str) -> Any:
    """Return what "module:attribute" names; raises ImportError or AttributeError."""
    module, _, attribute = reference.partition(":")
    return getattr(import_module(module), attribute)


@cache
def _found() -> tuple[dict[str, VehicleKind], dict[str, str]]:
    kinds: dict[str, VehicleKind] = {}
    refused: dict[str, str] = {}
    for name, source, get in (*_ours(), *_of_others()):
        try:
            kinds[name] = _sound(name, get(), kinds)
        except Exception as error:  # noqa: BLE001 - a plug-in is anybody's program: its failure is told, ours goes on
            refused[name] = f"{source}: {type(error).__name__}: {error}"
    return kinds, refused


def _ours() -> Iterator[tuple[str, str, Callable[[], object]]]:
    # By place, not by entry point: those are written when the program is installed, and a checkout is not.
    spec = find_spec(_OURS)
    for package in pkgutil.iter_modules(spec.submodule_search_locations if spec is not None else None):
        module = f"{_OURS}.{package.name}.kind"
        if package.ispkg and find_spec(module) is not None:
            yield package.name, module, lambda module=module: load(f"{module}:KIND")  # type: ignore[misc]


def _of_others() -> Iterator[tuple[str, str, Callable[[], object]]]:
    for name, source, entry in plug_ins.entries(plug_ins.VEHICLES):
        yield name, source, entry.load


def _sound(name: str, kind: object, known: dict[str, VehicleKind]) -> VehicleKind:
    if not isinstance(kind, VehicleKind):
        raise TypeError(f"is a {type(kind).__name__}, no groundstation.vehicles.VehicleKind")
    if kind.name != name:
        raise ValueError(f"calls itself {kind.name}: the entry point and the kind must have the same name")
    if name in known:
        raise ValueError("there is a kind of this name already")
    taken = {key: other.name for other in known.values() for key in other.sections}
    for key in kind.sections:
        if key in taken:
            raise ValueError(f"its section {key} is that of {taken[key]}")
    return kind

"""Plug-ins of other packages by entry point: found by name, loaded on request; errors name those that fail.

Groups: `skein.vehicles` (kinds of vehicles), `skein.cameras` (schemes of camera sources), `skein.planners`,
`skein.world_sensors` (schemes of motion capture sources), `skein.markers` (dictionaries of square tags).
"""

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cache
from inspect import getattr_static, signature
from typing import TYPE_CHECKING, Any

from groundstation.errors import SettingsError

if TYPE_CHECKING:
    from importlib import metadata

VEHICLES, CAMERAS, PLANNERS = "skein.vehicles", "skein.cameras", "skein.planners"
WORLD_SENSORS, MARKERS = "skein.world_sensors", "skein.markers"
_PLANNED_FROM = ("belief", "current", "warm_start", "should_stop", "max_evaluations")


def _as_it_is() -> None:
    """Prepare nothing."""


before_planners: Callable[[], None] = _as_it_is
"""Called before a planner is imported; a program sets it. Most planners import kernels, and numba reads only at its own
import where compiled ones are kept: without that each command would compile them anew, for a minute."""


class PlugInError(ValueError):
    """A plug-in that is not installed, or that cannot be loaded; the text names it, its package and the reason."""


def entries(group: str) -> "Iterator[tuple[str, str, metadata.EntryPoint]]":
    """Yield name, "package (module:attribute)" and entry point of each plug-in of a group, by name."""
    for entry in sorted(_installed(group)[0], key=lambda entry: entry.name):
        package = entry.dist.name if entry.dist is not None else "?"
        yield entry.name, f"{package} ({entry.value})", entry


def names(group: str) -> tuple[str, ...]:
    """Return the names of the installed plug-ins of a group; none is loaded."""
    return tuple(dict.fromkeys(name for name, _, _ in entries(group)))


def damage() -> str:
    """Return, after "; ", which packages' plug-ins cannot even be listed; "" if there are none."""
    packages = ", ".join(_installed(VEHICLES)[1])
    return f"; {packages}: entry_points.txt is damaged: mend or uninstall that package" if packages else ""


def _installed(group: str) -> "tuple[Sequence[metadata.EntryPoint], list[str]]":
    """Return the entry points of a group, and the packages whose list of all their own cannot be read."""
    return _installed_on(tuple(sys.path), group)


@cache
def _installed_on(_path: tuple[str, ...], group: str) -> "tuple[Sequence[metadata.EntryPoint], list[str]]":
    # Imported here only: commands that stop drones must not wait for it.
    from importlib import metadata

    with suppress(Exception):  # one damaged list, of any package and in any group, makes it fail
        return metadata.entry_points(group=group), []
    found = list[metadata.EntryPoint]()
    first = dict[str, metadata.Distribution]()  # of each name on the path; only that one is ever imported
    for package in metadata.distributions():
        first.setdefault(re.sub("[-_.]+", "-", package.name or "?").lower(), package)
    damaged = list[str]()
    for name, package in first.items():
        try:
            found += package.entry_points.select(group=group)
        except Exception:  # noqa: BLE001 - whatever is wrong with it, the others go on
            damaged.append(name)
    return found, damaged


def planner_title(name: str) -> str:
    """Return "planner name (package)" for the operator, without a package if none brings it; "" for our own planner."""
    if not name:
        return ""
    found = next((source.split(" (")[0] for known, source, _ in entries(PLANNERS) if known == name), "")
    return f"planner {name} ({found})" if found else f"planner {name}"


def planner(name: str, parameters: object, sensors: object) -> Any:
    """Return a plug-in's replacement for `groundstation.planning.planner.Planner`; raises SettingsError naming it.

    It is constructed in the same way, from parameters and the team's sensors, and used by its `plan`.
    """
    try:
        return made(PLANNERS, name, ("plan",), parameters, sensors)
    except PlugInError as error:
        raise SettingsError([f"planner.plug_in: {error}"]) from error


@cache
def tag_family(name: str) -> Any:
    """Return the `groundstation.geometry.tag.TagFamily` of a dictionary, made once; raises PlugInError."""
    family = made(MARKERS, name, ("count", "bits", "corner_std_px", "finder", "black_cells"))
    try:
        if min(int(family.count), int(family.bits), float(family.corner_std_px)) <= 0:
            raise ValueError("count, bits and corner_std_px must be positive")
    except Exception as error:
        raise PlugInError(f"{name} cannot be used: {type(error).__name__}: {error}") from error
    return family


def made(group: str, name: str, uses: Sequence[str], *arguments: object) -> Any:
    """Return a plug-in's result for arguments; raises PlugInError, also if it lacks an attribute of `uses`."""
    source, make = _loaded(group, name)
    try:
        one = make(*arguments)
        if missing := [each for each in uses if not hasattr(one, each)]:
            raise TypeError(f"{type(one).__name__} without {', '.join(missing)}")
        if group == PLANNERS:
            _require_plan(one, type(one).__name__)
    except (Exception, SystemExit) as error:
        raise PlugInError(f"{name} cannot be used: {source}: {reason(error)}") from error
    return one


def load(group: str, name: str) -> Any:
    """Return the object of one plug-in; raises PlugInError."""
    return _loaded(group, name)[1]


def reason(error: BaseException) -> str:
    """Return a plug-in's exception as text for the operator."""
    return f"{type(error).__name__}: {error}"


def doubles(group: str) -> dict[str, str]:
    """Return the ambiguous names of a group, each with all plug-ins of that name."""
    sources: dict[str, list[str]] = {}
    for name, source, _ in entries(group):
        sources.setdefault(name, []).append(source)
    return {name: " and ".join(found) for name, found in sources.items() if len(found) > 1}


def _loaded(group: str, name: str) -> tuple[str, Any]:
    if name in (several := doubles(group)):
        raise PlugInError(f"{name} cannot be used: {several[name]} have the same name: uninstall all but one")
    for found, source, entry in entries(group):
        if found == name:
            if group == PLANNERS:
                before_planners()
            try:
                make = entry.load()
                _require_callable(make, "")
                if group == PLANNERS:
                    _require_planner(make)
                return source, make
            except (Exception, SystemExit) as error:  # a plug-in that exits at import must not end this program
                raise PlugInError(f"{name} cannot be used: {source}: {reason(error)}") from error
    known = ", ".join(names(group)) or "none is installed"
    raise PlugInError(f"{name} is not known; known in {group}: {known}{damage()}")


def _require_callable(one: object, what: str) -> None:
    if not callable(one):
        raise TypeError(f"{what}is of type {type(one).__name__}, nothing that can be called")


def _require_planner(make: Any) -> None:
    """Raise TypeError for what cannot be made or asked as `groundstation.planning.planner.Planner` is.

    Of a function only the planner that it makes shows how that is asked.
    """
    name = getattr(make, "__name__", type(make).__name__)
    _require_arguments(make, f"{name} is made", ("parameters", "sensors"))
    if isinstance(make, type):
        _require_plan(make, name)


def _require_plan(planner: Any, name: str) -> None:
    """Raise TypeError for a planner, or its class, whose `plan` is missing or takes other arguments."""
    if not hasattr(planner, "plan"):
        raise TypeError(f"{name} without plan")
    _require_callable(planner.plan, f"{name}.plan ")
    bound = not isinstance(planner, type) or isinstance(getattr_static(planner, "plan"), staticmethod | classmethod)
    held = ("held",) if getattr(planner, "takes_held", False) else ()
    _require_arguments(planner.plan, f"{name}.plan is called", (*(() if bound else ("self",)), *_PLANNED_FROM), held)


def _require_arguments(called: Any, what: str, positional: Sequence[str], keywords: Sequence[str] = ()) -> None:
    try:
        known = signature(called)
    except (TypeError, ValueError):  # of another language: only a call would show it
        return
    try:
        known.bind(*positional, **dict.fromkeys(keywords))
    except TypeError as error:
        told = ", ".join((*(one for one in positional if one != "self"), *(f"{one}=..." for one in keywords)))
        raise TypeError(f"{what} with ({told}): {error}") from None

"""Plug-ins of other packages by entry point: found by name, loaded when asked for; one that fails is named.

Groups: `skein.vehicles` (kinds of vehicles), `skein.cameras` (schemes of camera sources), `skein.planners`,
`skein.world_sensors` (schemes of motion capture sources), `skein.markers` (dictionaries of square tags).
"""

from collections.abc import Iterator
from functools import cache
from importlib import metadata
from typing import Any

from groundstation.errors import SettingsError

VEHICLES, CAMERAS, PLANNERS = "skein.vehicles", "skein.cameras", "skein.planners"
WORLD_SENSORS, MARKERS = "skein.world_sensors", "skein.markers"


class PlugInError(ValueError):
    """A plug-in that is not installed, or that cannot be loaded; the text names it, its package and the reason."""


def entries(group: str) -> Iterator[tuple[str, str, metadata.EntryPoint]]:
    """Yield name, "package (module:attribute)" and entry point of each plug-in of a group, by name."""
    for entry in sorted(metadata.entry_points(group=group), key=lambda entry: entry.name):
        package = entry.dist.name if entry.dist is not None else "?"
        yield entry.name, f"{package} ({entry.value})", entry


def names(group: str) -> tuple[str, ...]:
    """Return the names of the installed plug-ins of a group; none is loaded."""
    return tuple(dict.fromkeys(name for name, _, _ in entries(group)))


def planner(name: str, parameters: object, sensors: object) -> Any:
    """Return what plans instead of `groundstation.planning.planner.Planner`; raises SettingsError naming the plug-in.

    Made as that one is, from its parameters and the team's sensors, and used by its `plan`.
    """
    try:
        return load(PLANNERS, name)(parameters, sensors)
    except PlugInError as error:
        raise SettingsError([f"planner.plug_in: {error}"]) from error


@cache
def tag_family(name: str) -> Any:
    """Return the `groundstation.geometry.tag.TagFamily` of a dictionary, made once; raises PlugInError."""
    make = load(MARKERS, name)
    try:
        family = make()
        if min(int(family.count), int(family.bits), float(family.corner_std_px)) <= 0:
            raise ValueError("count, bits and corner_std_px must be positive")
        _ = family.finder, family.black_cells
    except Exception as error:
        raise PlugInError(f"{name} cannot be used: {type(error).__name__}: {error}") from error
    return family


def load(group: str, name: str) -> Any:
    """Return the object of one plug-in; raises PlugInError."""
    for found, source, entry in entries(group):
        if found != name:
            continue
        try:
            return entry.load()
        except Exception as error:
            raise PlugInError(f"{name} cannot be used: {source}: {type(error).__name__}: {error}") from error
    known = ", ".join(names(group)) or "none is installed"
    raise PlugInError(f"{name} is not known; known in {group}: {known}")

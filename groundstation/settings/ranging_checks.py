"""Checks of ranging systems against the team and the room."""

import math
from collections.abc import Container, Iterable, Iterator, Mapping
from itertools import combinations

import numpy as np

from groundstation.arrays import Array
from groundstation.settings.document import KeyPath
from groundstation.settings.ranging import RangingSettings
from groundstation.settings.room import RoomSettings

_APART_M = 0.1
# Spread of anchors [m; root of the summed squares] along a direction below which ranges hardly tell places along it.
_LEAST_SPREAD_M = 0.6


def untold_directions(system: RangingSettings) -> Array:
    """Return the directions (n, 3) across the line or plane in which the anchors nearly lie; none otherwise."""
    places = np.array([*system.anchors.values()])
    _, spread_m, directions = np.linalg.svd(places - places.mean(axis=0))
    return directions[spread_m < _LEAST_SPREAD_M]


def findings_of_lines(systems: Mapping[str, RangingSettings]) -> Iterator[tuple[KeyPath, str]]:
    """Return the systems if the anchors of each lie in a line, and nothing else fixed locates drones."""
    if all(len(untold_directions(one)) > 1 for one in systems.values()):
        text = "lie nearly in one line: ranges tell a circle around it, no place, and nothing else fixed locates drones"
        yield from ((("ranging", name, "anchors"), text) for name in systems)


def findings_of_ranging(
    systems: Mapping[str, RangingSettings], drones: Container[str], flying: Iterable[str], room: RoomSettings | None
) -> Iterator[tuple[KeyPath, str]]:
    """Return transponders that no drone or two drones carry, and anchors outside of the room."""
    for name, system in systems.items():
        holders = {drone: drone for drone in flying if drone not in system.transponders}  # named as their drones
        for drone, one in system.transponders.items():
            path, called = ("ranging", name, "transponders", drone), one.name or drone
            if drone not in drones:
                yield path, f"{drone} is no drone of the field"
            if called in holders:
                yield path, f"the transponder's name {called} is already that of {holders[called]}"
            holders.setdefault(called, drone)
        for (near, here), (far, there) in combinations(system.anchors.items(), 2):
            if math.dist(here, there) < _APART_M:
                yield ("ranging", name, "anchors", far), f"is where {near} is"
        if room is not None:
            x, y, z = room.size_m
            for anchor, place in system.anchors.items():
                if abs(place[0]) > x / 2 or abs(place[1]) > y / 2 or not 0.0 <= place[2] <= z:
                    yield ("ranging", name, "anchors", anchor), "must be inside the room"

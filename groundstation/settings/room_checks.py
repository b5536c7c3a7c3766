"""Checks of places and heights: fence, obstacles, cameras, pads and levels."""

import math
from collections.abc import Iterator
from itertools import combinations

from groundstation.settings.drones import Drone
from groundstation.settings.level_heights import FENCE_MARGIN_M, OVER_TARGET_M
from groundstation.settings.parts import Finding, Parts
from groundstation.vehicles import kind_named

_ROBOT_HEIGHT_M = 0.3


def findings_in_room(parts: Parts) -> Iterator[Finding]:
    """Return places and heights outside of their permitted ranges."""
    for check in (_fence_in_room, _obstacles, _cameras_above_fence, _pads, _take_offs, _heights):
        yield from check(parts)


def _fence_in_room(parts: Parts) -> Iterator[Finding]:
    if parts.room is None:
        return
    for name, (low, high) in parts.room.inside.items():
        least, most = getattr(parts.room.fence, name)
        if least < low or most > high:
            yield ("room", "fence", name), f"must lie inside the room, {low:g} to {high:g} (got {least:g} to {most:g})"


def _obstacles(parts: Parts) -> Iterator[Finding]:
    if parts.room is None:
        return
    for name, one in parts.room.obstacles.items():
        path = ("room", "obstacles", name)
        (x, y), half, height = one.centre_m, (one.size_m[0] / 2, one.size_m[1] / 2), one.size_m[2]
        for axis, least, most in (("x", x - half[0], x + half[0]), ("y", y - half[1], y + half[1])):
            low, high = parts.room.inside[f"{axis}_m"]
            if least < low or most > high:
                span = f"{axis} {low:g} to {high:g} (got {least:g} to {most:g})"
                yield path, f"must stand inside the room, {span}"
        if height > (ceiling := parts.room.size_m[2]):
            yield path, f"must be no higher than the room, {ceiling:g} m (got {height:g})"
        for drone, own in parts.flying.items():
            if abs(own.pad_m[0] - x) < half[0] and abs(own.pad_m[1] - y) < half[1]:
                yield ("drones", drone, "pad_m"), f"lies in room.obstacles.{name}"


def _cameras_above_fence(parts: Parts) -> Iterator[Finding]:
    if parts.room is None:
        return
    inside, top = parts.room.inside, parts.room.fence.z_m[1]
    for name, camera in parts.cameras.items():
        path, height = ("cameras", name, "position_m"), camera.position_m[2]
        for axis, at in zip("xyz", camera.position_m, strict=True):
            low, high = inside[f"{axis}_m"]
            if at > high or (at < low and axis != "z"):
                yield path, f"must lie inside the room, {axis} {low:g} to {high:g} (got {at:g})"
        if height <= top:
            yield path, f"must hang above the fence: height > {top:g} (got {height:g})"


def _pads(parts: Parts) -> Iterator[Finding]:
    if parts.room is not None:
        for name, drone in parts.flying.items():
            if not parts.room.fence.contains(*drone.pad_m):
                yield ("drones", name, "pad_m"), f"must lie inside the fence (got {list(drone.pad_m)})"
    if parts.safety is None:
        return
    least = parts.safety.min_separation_m
    for (first, one), (second, other) in combinations(parts.flying.items(), 2):
        distance = math.dist(one.pad_m, other.pad_m)
        if distance < least:
            yield (
                ("drones", second, "pad_m"),
                f"is {distance:.2f} m from the pad of {first}: must be >= {least:g} (safety.min_separation_m)",
            )


def _take_offs(parts: Parts) -> Iterator[Finding]:
    """Yield take-offs that lead out of the fence: a vehicle climbs by itself, and the output limiter is not asked."""
    top_m = math.inf if parts.room is None else parts.room.fence.z_m[1]
    for name, drone in parts.flying.items():
        take_off = kind_named(drone.kind).take_off
        if isinstance(take_off, float) and take_off > top_m:
            words = f"must be >= {take_off:g}, the height to which {name} ({drone.kind}) takes off by itself"
            yield ("room", "fence", "z_m", 1), f"{words} (got {top_m:g})"
        elif isinstance(take_off, tuple) and (height_m := _height_of(drone, *take_off)) > top_m:
            words = f"must be <= {top_m:g} (room.fence.z_m): lower it, or raise the fence"
            yield ("drones", name, *take_off), f"{words} (got {height_m:g})"


def _height_of(drone: Drone, section: str, key: str) -> float:
    """Return a height of a drone's own section [m], its default where the file has none."""
    own, model = drone.sections.get(section), kind_named(drone.kind).sections[section]
    return float(getattr(own, key) if own is not None else model.model_fields[key].default)


def _heights(parts: Parts) -> Iterator[Finding]:
    if parts.planner is None:
        return
    rows = parts.planner.level_heights_m
    if not rows:
        yield from _room_over_targets(parts)
    elif len(rows) < len(parts.flying):
        yield (
            ("planner", "level_heights_m"),
            f"must hold a row for each number of levels, 1 to {len(parts.flying)} drones, or be left out "
            f"(got {len(rows)})",
        )
    low = max((one.marker.height_m + _ROBOT_HEIGHT_M for _, one in parts.tracked.values()), default=0.0)
    high = math.inf
    if parts.room is not None:
        low, high = max(low, parts.room.fence.z_m[0]), parts.room.fence.z_m[1]
    for index, row in enumerate(rows):
        for slot, height in enumerate(row):
            if not low <= height <= high:
                path = ("planner", "level_heights_m", index, slot)
                yield path, f"must be between {low:g} (over the target) and {high:g} (the fence) (got {height:g})"


def _room_over_targets(parts: Parts) -> Iterator[Finding]:
    """Yield a fence too low for flights over the targets, where no heights are given."""
    least_m = max((one.marker.height_m for _, one in parts.tracked.values()), default=0.0)
    least_m += OVER_TARGET_M + FENCE_MARGIN_M
    if parts.room is not None and parts.room.fence.z_m[1] < least_m:
        top = parts.room.fence.z_m[1]
        yield ("room", "fence", "z_m"), f"must reach {least_m:g} m for drones to fly over the target (got {top:g})"

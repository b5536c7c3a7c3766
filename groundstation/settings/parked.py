"""Targets that a scenario parks where a drone stands."""

import math
from collections.abc import Mapping
from typing import Any

from groundstation.settings.drawing import on_figure_eight
from groundstation.settings.schema import Field

_APART_M = 0.35  # half of a drone and half of a small robot: one marker hides the other from above


def on_pads(field: Field, scenario: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each target that waits on a drone's pad until the team flies."""
    found = []
    for name, place in _starts(scenario, list(field.tracked)).items():
        for drone, one in field.drones.items():
            if (apart := math.dist(place, one.pad_m)) < _APART_M:
                x, y = place
                found.append(
                    f"{name} is parked at ({x:.1f}, {y:.1f}), {apart:.1f} m from the pad of {drone}, and hides its "
                    "marker: set its path in a scenario of your own, or move the pad"
                )
    return found


def _starts(scenario: Mapping[str, Any], targets: list[str]) -> dict[str, tuple[float, float]]:
    """Return the first places of targets, as far as the scenario has them; of a path for all, the first target's."""
    own, common = scenario.get("targets", {}), scenario.get("target", {})
    paths = {name: own[name].get("path", {}) for name in targets if name in own}
    if targets[0] not in own:
        paths[targets[0]] = common.get("path", {})
    places = {name: _start(path) for name, path in paths.items()}
    return {name: place for name, place in places.items() if place is not None}


def _start(path: Mapping[str, Any]) -> tuple[float, float] | None:
    shape = path.get("shape", "figure_eight")
    if shape == "figure_eight":
        return on_figure_eight(path, path.get("start_phase", 0.0))
    if shape == "waypoints":
        x, y = path["points_m"][0]
        return x, y
    return None

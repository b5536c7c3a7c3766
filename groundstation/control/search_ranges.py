"""Range within which a searching robot's camera finds targets: longer than plans count on."""

from collections.abc import Mapping
from dataclasses import replace

from groundstation.field.drones import FieldDrone
from groundstation.field.resolved import ResolvedField
from groundstation.sensing.from_field import square_m
from groundstation.sensing.models import OnboardCameraModel

SEARCH_PX = 8.8
"""Size of a square that is found in 86 % of fully searched pictures (docs/reference/vision.md 2)."""


def search_ranges_m(resolved: ResolvedField) -> dict[str, float]:
    """Return the range of a full search of each drone's pictures for all targets [m], at least that of plans."""
    return {name: _range_m(drone, resolved) for name, drone in resolved.drones.items()}


def searching_cameras(
    cameras: Mapping[str, OnboardCameraModel], ranges_m: Mapping[str, float]
) -> dict[str, OnboardCameraModel]:
    """Return cameras with the ranges within which their pictures are searched; those without a range as they are."""
    return {
        name: replace(camera, view=replace(camera.view, range_m=ranges_m[name])) if name in ranges_m else camera
        for name, camera in cameras.items()
    }


def _range_m(drone: FieldDrone, resolved: ResolvedField) -> float:
    smallest_m = min(square_m(target.marker) for target in resolved.tracked.values())
    found_m = drone.camera.calibration.fx_px * smallest_m / SEARCH_PX
    return max(resolved.planner.planned_range_m, found_m)

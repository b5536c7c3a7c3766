"""The sensor suite that follows from a resolved field."""

import math
from collections.abc import Mapping
from typing import Any

from groundstation.estimation.targets import targets_of
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.sensing.models import Frustum, Noise, OnboardCamera, SensorSuite, WorldCamera

BORDER_SQUARES = 3.5
"""Half the diagonal of a board, in squares of it: the whole board must be in the picture."""

DETECTION_PX = 10.0
"""A square must be this large to be found with certainty; bounds the range of world-fixed cameras."""

TAG_SQUARES = 3.8
"""A tag is found as far as a checkerboard with squares of this part of its side (measured: 168 mm like 44 mm)."""

ATTITUDE_REPEATS = 2.0
"""Attitude errors last for seconds: they are counted with this multiple, as if they were white."""


def sensors_from_field(resolved: Mapping[str, Any]) -> SensorSuite:
    """Return the suite for a resolved field (decoded JSON of groundstation.settings.schema.Field)."""
    drones = {name: drone for name, drone in resolved["drones"].items() if drone.get("enabled", True)}
    targets = targets_of(resolved)
    heights = {name: float(drone["marker"]["position_m"][2]) for name, drone in drones.items()}
    square = min((_square_m(drone["marker"]) for drone in drones.values()), default=0.044)
    smallest = min(square, *(_square_m(target["marker"]) for target in targets.values()))
    reach = resolved["planner"]["planned_range_m"]
    return SensorSuite(
        world={name: _world(camera, square) for name, camera in resolved["cameras"].items()},
        onboard={name: _onboard(drone, smallest, reach) for name, drone in drones.items()},
        marker_height_m=heights | {name: float(target["marker"]["height_m"]) for name, target in targets.items()},
    )


def _square_m(marker: Mapping[str, Any]) -> float:
    """Return the square of the checkerboard that is seen as far as a marker is."""
    if marker.get("kind") == "aruco":
        return float(marker["size_mm"]) / TAG_SQUARES / 1000
    return float(marker["square_mm"]) / 1000


def _frustum(calibration: Mapping[str, Any], range_m: float, square_m: float) -> Frustum:
    size = (calibration["width_px"], calibration["height_px"], calibration["fx_px"], calibration["fy_px"])
    return Frustum.of_picture(*size, range_m, BORDER_SQUARES * square_m)


def _world(camera: Mapping[str, Any], square_m: float) -> WorldCamera:
    calibration = camera["calibration"]
    noise = Noise(math.hypot(0.015, camera["position_std_m"]), math.radians(camera["attitude_std_deg"]), 0.0, 0.035)
    reach = calibration["fx_px"] * square_m / DETECTION_PX
    rotation = world_from_downward_optical(camera.get("rotation_deg", (0.0, 0.0, 0.0)))
    return WorldCamera(tuple(camera["position_m"]), _frustum(calibration, reach, square_m), noise, rotation.T)


def _onboard(drone: Mapping[str, Any], square_m: float, range_m: float) -> OnboardCamera:
    camera = drone["camera"]
    return OnboardCamera(
        position_m=tuple(camera["position_m"]),
        view=_frustum(camera["calibration"], range_m, square_m),
        tilt_down_rad=math.radians(camera["tilt_down_deg"]),
        pan_left_rad=math.radians(camera.get("pan_left_deg", 0.0)),
        noise=Noise(0.02, ATTITUDE_REPEATS * math.radians(drone["odometry"]["attitude_std_deg"]), 0.004, 0.05),
    )

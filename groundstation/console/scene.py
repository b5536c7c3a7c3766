"""What does not move: the room, who is in it, and how each camera looks, in the form that the page draws."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.estimation.targets import targets_of
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.rotations import base_from_tilted_optical, world_from_downward_optical

Array = NDArray[np.float64]
Json = dict[str, Any]

_EDGE_POINTS = 8
# `looking: down`: picture right is world x, picture down is world -y.
_LENS_FIELDS = ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px")


def scene_from_field(field: Mapping[str, Any], truth: bool) -> Json:
    """Return the scene of a resolved field (decoded JSON)."""
    planner = field["planner"]
    return {
        "site": field["site"],
        "truth": truth,
        "room": {"size_m": field["room"]["size_m"], "fence": field["room"]["fence"]},
        "drones": [_drone(name, drone) for name, drone in field["drones"].items()],
        "cameras": [_world_camera(name, camera) for name, camera in field["cameras"].items()],
        "targets": [
            {"name": name, "height_m": target["marker"]["height_m"]} for name, target in targets_of(field).items()
        ],
        "horizon": {"steps": planner["horizon_steps"], "step_s": planner["step_s"]},
        "hysteresis": planner["hysteresis"],
        "planned_range_m": planner["planned_range_m"],
        "lost_after_s": field["estimator"]["lost_after_s"],
    }


def bare_scene(site: str, drones: tuple[str, ...], truth: bool) -> Json:
    """Return a scene for a run whose field is not known: names only, in a room of the usual size."""
    return {
        "site": site,
        "truth": truth,
        "room": {"size_m": [8.0, 6.0, 4.5], "fence": None},
        "drones": [{"name": name, "battery_min": 0.15} for name in drones],
        "cameras": [],
        "targets": [],
        "horizon": {"steps": 10, "step_s": 0.3},
        "hysteresis": 0.0,
        "planned_range_m": 2.0,
        "lost_after_s": 3.0,
    }


def lenses_of(field: Mapping[str, Any]) -> dict[str, CameraIntrinsics]:
    """Return the lens of each camera by its name on the bus."""
    fixed = {name: camera["calibration"] for name, camera in field["cameras"].items()}
    carried = {f"{name}_camera": drone["camera"]["calibration"] for name, drone in field["drones"].items()}
    return {name: _lens(calibration) for name, calibration in (fixed | carried).items()}


def _lens(calibration: Mapping[str, Any]) -> CameraIntrinsics:
    figures = {name: calibration[name] for name in _LENS_FIELDS}
    return CameraIntrinsics(**figures, distortion=tuple(calibration["distortion"]))


def _drone(name: str, drone: Mapping[str, Any]) -> Json:
    camera = drone["camera"]
    tilt, pan = np.radians(camera["tilt_down_deg"]), np.radians(camera["pan_left_deg"])
    return {
        "name": name,
        "battery_min": drone["limits"]["battery_min"],
        "max_speed_m_s": drone["limits"]["max_speed_m_s"],
        "pad_m": drone["pad_m"],
        "pad_yaw_rad": float(np.radians(drone["pad_yaw_deg"])),
        "camera": {
            "name": f"{name}_camera",
            "position_m": camera["position_m"],
            "rays": _rays(_lens(camera["calibration"]), base_from_tilted_optical(float(tilt), float(pan))),
        },
    }


def _world_camera(name: str, camera: Mapping[str, Any]) -> Json:
    rays = _rays(_lens(camera["calibration"]), world_from_downward_optical(camera.get("rotation_deg", (0.0, 0.0, 0.0))))
    return {"name": name, "position_m": camera["position_m"], "rays": rays, "observes": camera["observes"]}


def _rays(lens: CameraIntrinsics, rotation: Array) -> list[list[float]]:
    """Return directions along the border of the picture, distortion undone, in the frame that `rotation` leads to."""
    along = np.linspace(0.0, 1.0, _EDGE_POINTS, endpoint=False)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * [lens.width_px, lens.height_px] - 0.5
    edges = [a + along[:, None] * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    flat = lens.normalised_from_pixels(np.concatenate(edges))
    flat = flat[np.isfinite(flat).all(axis=1)]
    directions = np.column_stack((flat, np.ones(len(flat)))) @ rotation.T
    return np.round(directions, 5).tolist()  # type: ignore[no-any-return]

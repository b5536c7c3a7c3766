"""The static scene for the page: the room, the entities in it, and each camera's view."""

from collections.abc import Iterable
from typing import Any

import msgspec
import numpy as np

from groundstation.appearance.colours import FENCE_COLOUR, colours_of
from groundstation.arrays import Array
from groundstation.field.drones import FieldDrone, camera_name
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import Volume, WorldCamera
from groundstation.geometry.lens import CameraIntrinsics, intrinsics_of
from groundstation.geometry.rotations import base_from_tilted_optical, world_from_downward_optical

Json = dict[str, Any]

_EDGE_POINTS = 8


def scene_from_field(field: ResolvedField, truth: bool) -> Json:
    """Return the scene of a resolved field."""
    planner = field.planner
    return {
        "site": field.site,
        "truth": truth,
        "room": msgspec.to_builtins(field.room),
        "drones": [_drone(name, drone) for name, drone in field.drones.items()],
        "cameras": [_world_camera(name, camera) for name, camera in field.cameras.items()],
        "volumes": [_volume(name, box, name in field.truth.values()) for name, box in field.volumes.items()],
        "targets": [{"name": name, "height_m": target.marker.height_m} for name, target in field.tracked.items()],
        **_colours(field.drones, field.tracked),
        "horizon": {"steps": planner.horizon_steps, "step_s": planner.step_s},
        "hysteresis": planner.hysteresis,
        "planned_range_m": planner.planned_range_m,
        "lost_after_s": field.estimator.lost_after_s,
        "unseen_land_s": field.safety.unseen_land_at_last_s,
    }


def bare_scene(site: str, drones: tuple[str, ...], truth: bool) -> Json:
    """Return a scene for a run with an unknown field: names only, in a room of the usual size."""
    return {
        "site": site,
        "truth": truth,
        "room": {"size_m": [8.0, 6.0, 4.5], "fence": None, "obstacles": {}},
        "drones": [{"name": name} for name in drones],
        "cameras": [],
        "volumes": [],
        "targets": [],
        **_colours(drones, ()),
        "horizon": {"steps": 10, "step_s": 0.3},
        "hysteresis": 0.0,
        "planned_range_m": 2.0,
        "lost_after_s": 3.0,
        "unseen_land_s": 30.0,
    }


def _colours(drones: Iterable[str], targets: Iterable[str]) -> Json:
    return {
        "colours": msgspec.to_builtins(colours_of(drones, targets)),
        "fence_colour": msgspec.to_builtins(FENCE_COLOUR),
    }


def lenses_of(field: ResolvedField) -> dict[str, CameraIntrinsics]:
    """Return the lens of each camera by its name on the bus."""
    return {name: intrinsics_of(calibration) for name, calibration in field.calibrations.items()}


def _drone(name: str, drone: FieldDrone) -> Json:
    camera = drone.camera
    tilt, pan = np.radians(camera.tilt_down_deg), np.radians(camera.pan_left_deg)
    return {
        "name": name,
        "max_speed_m_s": drone.limits.max_speed_m_s,
        "pad_m": drone.pad_m,
        "pad_yaw_rad": float(np.radians(drone.pad_yaw_deg)),
        "camera": {
            "name": camera_name(name),
            "position_m": camera.position_m,
            "rays": _rays(intrinsics_of(camera.calibration), base_from_tilted_optical(float(tilt), float(pan))),
        },
    }


def _world_camera(name: str, camera: WorldCamera) -> Json:
    rays = _rays(intrinsics_of(camera.calibration), world_from_downward_optical(camera.rotation_deg))
    return {"name": name, "position_m": camera.position_m, "rays": rays, "observes": camera.observes}


def _volume(name: str, box: Volume, is_truth: bool) -> Json:
    return {"name": name, "truth": is_truth, **msgspec.to_builtins(box)}


def _rays(lens: CameraIntrinsics, rotation: Array) -> list[list[float]]:
    """Return directions along the border of the picture, distortion undone, in the frame to which `rotation` leads."""
    along = np.linspace(0.0, 1.0, _EDGE_POINTS, endpoint=False)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * [lens.width_px, lens.height_px] - 0.5
    edges = [a + along[:, None] * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    flat = lens.normalised_from_pixels(np.concatenate(edges))
    flat = flat[np.isfinite(flat).all(axis=1)]
    directions = np.column_stack((flat, np.ones(len(flat)))) @ rotation.T
    rounded: list[list[float]] = np.round(directions, 5).tolist()
    return rounded

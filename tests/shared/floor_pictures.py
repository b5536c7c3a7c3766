"""Markers on a floor: their corners, and pictures of them by a turned ceiling camera, as files."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.board import Checkerboard, raster
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import rotation_z, world_from_downward_optical

LENS = CameraIntrinsics(1280, 720, 1179.0, 1179.0, 639.5, 359.5, residual_px=0.1)
TURN_DEG = (1.2, -0.8, 15.0)
CEILING = Pose(world_from_downward_optical(TURN_DEG), np.array([0.2, -0.1, 3.2]))
PLACES = {1: (0.9, 0.6), 2: (-0.8, 0.5), 3: (-0.7, -0.7), 4: (0.8, -0.6)}
HEADINGS = {1: 0.3, 2: -1.2, 3: 2.0, 4: 0.0}


def corners_of(
    code: int, camera: Pose = CEILING, lens: CameraIntrinsics = LENS, at: Sequence[float] | None = None
) -> Array:
    x, y, z = (*(at or PLACES[code]), 0.0)[:3]
    points = Checkerboard(code, 44.0).corners() @ rotation_z(HEADINGS.get(code, 0.0)).T + (x, y, z)
    return lens.project(camera.inverse().apply(points))


def drawn(camera: Pose, lens: CameraIntrinsics, marks: Mapping[int, tuple[float, float, float, float]]) -> Any:
    """Return a picture of markers {code: (x, y, z, yaw)} on grey ground."""
    picture = np.full((lens.height_px, lens.width_px), 120, np.uint8)
    for code, (x, y, z, yaw) in marks.items():
        texels, texel_from_marker = raster(code, 24.0)
        frame = Pose(rotation_z(yaw), np.array([x, y, z]))
        optical = camera.inverse().compose(frame)
        plane = np.column_stack((optical.rotation[:, :2] * 0.044, optical.translation))
        h = lens.matrix @ plane @ np.linalg.inv(texel_from_marker)
        size = (lens.width_px, lens.height_px)
        mask = cv2.warpPerspective(np.full_like(texels, 255), h, size, flags=cv2.INTER_AREA)
        card = cv2.warpPerspective(cv2.GaussianBlur(texels, (0, 0), 1.5), h, size, flags=cv2.INTER_LINEAR)
        picture = np.where(mask > 127, card, picture)
    return cv2.GaussianBlur(picture, (0, 0), 0.6)


def files_for(tmp_path: Path, lens: CameraIntrinsics, picture: Any, frames: int = 3) -> tuple[str, str]:
    (tmp_path / "in").mkdir()
    rng = np.random.default_rng(1)
    for number in range(frames):
        noisy = picture + rng.normal(0.0, 2.0, picture.shape)
        cv2.imwrite(str(tmp_path / "in" / f"{number}.png"), np.clip(noisy, 0, 255).astype(np.uint8))
    calibration = tmp_path / "lens.yaml"
    names = ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "residual_px")
    content = {"model": "plumb_bob", "distortion": list(lens.distortion)} | {n: getattr(lens, n) for n in names}
    calibration.write_text(json.dumps(content))
    return str(tmp_path / "in"), str(calibration)


def markers(places: Mapping[int, tuple[float, float]] = PLACES) -> list[str]:
    return [f"--marker={code}={x},{y}" for code, (x, y) in places.items()]

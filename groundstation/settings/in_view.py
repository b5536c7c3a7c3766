"""Checks whether a point is in a world-fixed camera's picture."""

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.settings.room import WorldCameraSettings

STANDING_MARKER_M = 0.14
"""Height of the marker of a drone that stands on its pad."""


def in_picture(camera: WorldCameraSettings, centre: Array) -> bool:
    """Return whether a point (3,) [world] is in a camera's picture, by its lens without distortion."""
    x, y, z = world_from_downward_optical(camera.rotation_deg).T @ (centre - np.array(camera.position_m))
    lens = camera.calibration
    if z <= 0.0:
        return False
    column, row = lens.cx_px + lens.fx_px * x / z, lens.cy_px + lens.fy_px * y / z
    return bool(0.0 < column < lens.width_px and 0.0 < row < lens.height_px)

"""Bodies under the boards: simple dark convex shapes, drawn as the hull of a drum."""

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from sim_bridge.render.spec import BodyShape


class Drum(NamedTuple):
    """Radius, lower and upper end [m; base], and grey level."""

    radius_m: float
    low_m: float
    high_m: float
    grey: int


DRUMS = {
    BodyShape.DRONE: (Drum(0.26, -0.03, 0.05, 60),),
    BodyShape.TURTLEBOT: (Drum(0.177, 0.0, 0.12, 40), Drum(0.16, 0.12, 0.39, 55)),
}
_SIDES = 12
_SHIFT = 4


def _ring(drum: Drum) -> NDArray[np.float64]:
    angles = np.arange(_SIDES) * math.tau / _SIDES
    circle = np.column_stack((np.cos(angles), np.sin(angles))) * drum.radius_m
    return np.vstack([np.column_stack((circle, np.full(_SIDES, z))) for z in (drum.low_m, drum.high_m)])


_RINGS = {drum: _ring(drum) for drums in DRUMS.values() for drum in drums}


def draw_body(
    picture: NDArray[np.uint8], shape: BodyShape, optical_from_base: Pose, intrinsics: CameraIntrinsics
) -> None:
    """Draw a body's silhouette, unless part of it is behind the camera."""
    for drum in DRUMS[shape]:
        points = optical_from_base.apply(_RINGS[drum])
        if points[:, 2].min() < 0.1:
            continue
        seen = [intrinsics.pixel(*point) for point in points.tolist()]
        pixels = np.array([pixel for pixel in seen if pixel is not None], dtype=np.float32)
        if len(pixels) < len(seen) or np.abs(pixels).max() > 1e4:
            continue
        hull = cv2.convexHull(pixels).reshape(-1, 1, 2)
        cv2.fillConvexPoly(picture, np.rint(hull * (1 << _SHIFT)).astype(np.int32), drum.grey, cv2.LINE_AA, _SHIFT)

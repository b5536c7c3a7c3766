"""Probability that a full search of a picture finds a marker, by the marker's place; compiled."""

import math

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.kernel import kernel
from groundstation.sensing.models import STEEPEST_COS
from groundstation.sensing.visibility import CameraRow

FOUND_SHARE = 0.7
"""Share of pictures in which a full search finds a marker in view: blur, glare and drones in between cost some."""


@kernel()
def detection(camera: CameraRow, pose: Vector, slack_m: float, x: float, y: float, z: float) -> float:
    """Return the probability that a picture shows a level marker at a world point [m].

    pose: x, y, z, yaw of the carrier, zeros for a camera fixed in the world; slack_m: distance by which the view's edge
    is moved inwards, for an uncertain pose.
    """
    c, s = math.cos(pose[3]), math.sin(pose[3])
    dx, dy, dz = x - pose[0], y - pose[1], z - pose[2]
    bx, by = c * dx + s * dy - camera.position[0], c * dy - s * dx - camera.position[1]
    bz = dz - camera.position[2]
    r = camera.rotation
    ox = r[0, 0] * bx + r[0, 1] * by + r[0, 2] * bz
    oy = r[1, 0] * bx + r[1, 1] * by + r[1, 2] * bz
    oz = r[2, 0] * bx + r[2, 1] * by + r[2, 2] * bz
    distance = math.sqrt(bx * bx + by * by + bz * bz)
    if oz <= 0.0 or -bz < STEEPEST_COS * distance:
        return 0.0
    tx, ty = camera.half_width_tan, camera.half_height_tan
    side = (oz * tx - abs(ox)) / math.sqrt(1.0 + tx * tx) - camera.border_m
    edge = (oz * ty - abs(oy)) / math.sqrt(1.0 + ty * ty) - camera.border_m
    margin = min(min(side, edge), camera.range_m - distance) - slack_m
    return FOUND_SHARE / (1.0 + math.exp(min(-margin / camera.width_m, 500.0)))


@kernel()
def detection_map(camera: CameraRow, pose: Vector, slack_m: float, xs: Vector, ys: Vector, z: float) -> Matrix:
    """Return the chance of `detection` for markers at each place of a grid (rows: ys, columns: xs) at one height."""
    found = np.zeros((ys.shape[0], xs.shape[0]))
    reach = camera.range_m + 0.5
    for j in range(ys.shape[0]):
        for i in range(xs.shape[0]):
            if abs(xs[i] - pose[0] - camera.position[0]) < reach and abs(ys[j] - pose[1] - camera.position[1]) < reach:
                found[j, i] = detection(camera, pose, slack_m, xs[i], ys[j], z)
    return found

"""Where the marker of any entity is, and how that depends on the entity's block: for all sensors that look at one."""

import math

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.kernel import kernel


@kernel("void(float64[::1], int64[::1], float64[::1], float64[::1], float64[::1])")
def marker_point(mean: Array, entity: IntArray, p: Array, point: Array, slope: Array) -> None:
    """Write the marker's centre [world] and its derivative (x, y) by the subject's yaw.

    Without z in the block the marker is at a known height; without yaw it is over the centre; without a block the
    entity stands where its parameters say.
    """
    start = entity[s.ENTITY_START]
    slope[0] = slope[1] = 0.0
    point[0], point[1], point[2] = p[s.PLACE_X], p[s.PLACE_Y], p[s.PLACE_Z]
    if entity[s.ENTITY_SIZE] == 0:
        return
    if entity[s.AT_YAW] >= 0:
        yaw = mean[start + entity[s.AT_YAW]]
        c, n = math.cos(yaw), math.sin(yaw)
        dx, dy = c * p[s.PLACE_X] - n * p[s.PLACE_Y], n * p[s.PLACE_X] + c * p[s.PLACE_Y]
        slope[0], slope[1] = -dy, dx
        point[0], point[1] = dx, dy
    point[0] += mean[start]
    point[1] += mean[start + 1]
    if entity[s.AT_Z] >= 0:
        point[2] += mean[start + entity[s.AT_Z]]


@kernel("void(int64[::1], float64[::1], float64[::1], float64[:,::1], int64)")
def chain_subject(entity: IntArray, slope: Array, by_point: Array, H: Array, row: int) -> None:
    """Write one row of H for the subject's block from the derivative by its marker's point (3)."""
    if entity[s.ENTITY_SIZE] == 0:
        return
    H[row, s.X], H[row, s.Y] = by_point[0], by_point[1]
    if entity[s.AT_Z] >= 0:
        H[row, entity[s.AT_Z]] = by_point[2]
    if entity[s.AT_YAW] >= 0:
        H[row, entity[s.AT_YAW]] += by_point[0] * slope[0] + by_point[1] * slope[1]


@kernel("void(int64[::1], float64[::1], float64, float64[::1])")
def marker_offset(entity: IntArray, p: Array, yaw: float, offset: Array) -> None:
    """Write where the marker is from the entity's centre [world's axes] for a given heading."""
    c, n = 1.0, 0.0
    if entity[s.AT_YAW] >= 0:
        c, n = math.cos(yaw), math.sin(yaw)
    offset[0] = c * p[s.PLACE_X] - n * p[s.PLACE_Y]
    offset[1] = n * p[s.PLACE_X] + c * p[s.PLACE_Y]
    offset[2] = p[s.PLACE_Z]

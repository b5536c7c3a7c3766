"""Where the marker of any entity is, and how that depends on the entity's block: for all sensors that look at one."""

import math

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.kernel import kernel


@kernel("void(float64[::1], float64[::1], float64[::1])", inlined=True)
def lean(p: Array, event: Array, offset: Array) -> None:
    """Write where the marker is from the entity's centre [base_stabilized]: what accelerates leans, and it with it."""
    roll, pitch = event[s.EVENT_SUBJECT_ROLL], event[s.EVENT_SUBJECT_PITCH]
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    offset[1], up = cr * p[s.PLACE_Y] - sr * p[s.PLACE_Z], sr * p[s.PLACE_Y] + cr * p[s.PLACE_Z]
    offset[0], offset[2] = cp * p[s.PLACE_X] + sp * up, cp * up - sp * p[s.PLACE_X]


@kernel("void(int64[::1], float64[::1], float64[::1], float64, float64[::1])", inlined=True)
def marker_offset(entity: IntArray, p: Array, event: Array, yaw: float, offset: Array) -> None:
    """Write where the marker is from the entity's centre [world's axes] for a given heading."""
    offset[0], offset[1], offset[2] = p[s.PLACE_X], p[s.PLACE_Y], p[s.PLACE_Z]
    if entity[s.AT_YAW] < 0:
        return
    lean(p, event, offset)
    c, n = math.cos(yaw), math.sin(yaw)
    offset[0], offset[1] = c * offset[0] - n * offset[1], n * offset[0] + c * offset[1]


@kernel("void(float64[::1], int64[::1], float64[::1], float64[::1], float64[::1], float64[::1])", inlined=True)
def marker_point(mean: Array, entity: IntArray, p: Array, event: Array, point: Array, slope: Array) -> None:
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
        marker_offset(entity, p, event, yaw, point)
        slope[0], slope[1] = -point[1], point[0]
    point[0] += mean[start]
    point[1] += mean[start + 1]
    if entity[s.AT_Z] >= 0:
        point[2] += mean[start + entity[s.AT_Z]]


@kernel("void(int64[::1], float64[::1], float64[::1], float64[:,::1], int64)", inlined=True)
def chain_subject(entity: IntArray, slope: Array, by_point: Array, H: Array, row: int) -> None:
    """Write one row of H for the subject's block from the derivative by its marker's point (3)."""
    if entity[s.ENTITY_SIZE] == 0:
        return
    H[row, s.X], H[row, s.Y] = by_point[0], by_point[1]
    if entity[s.AT_Z] >= 0:
        H[row, entity[s.AT_Z]] = by_point[2]
    if entity[s.AT_YAW] >= 0:
        H[row, entity[s.AT_YAW]] += by_point[0] * slope[0] + by_point[1] * slope[1]

"""Where the marker of any entity is, and how that depends on the entity's block: for all sensors that look at one."""

import math

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.records import EntityRow, EventRow, X, Y, Z
from groundstation.kernel import kernel


@kernel(inlined=True)
def lean(x: float, y: float, z: float, event: EventRow, offset: Vector) -> None:
    """Write where a point (x, y, z) of the subject [base] is [base_stabilized]: what accelerates leans."""
    roll, pitch = event.subject_roll, event.subject_pitch
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    offset[Y], up = cr * y - sr * z, sr * y + cr * z
    offset[X], offset[Z] = cp * x + sp * up, cp * up - sp * x


@kernel(inlined=True)
def offset_in_world(x: float, y: float, z: float, event: EventRow, yaw: float, offset: Vector) -> None:
    """Write where a point (x, y, z) of the subject [base] is from its centre [world's axes] for a given heading."""
    lean(x, y, z, event, offset)
    c, n = math.cos(yaw), math.sin(yaw)
    offset[X], offset[Y] = c * offset[X] - n * offset[Y], n * offset[X] + c * offset[Y]


@kernel(inlined=True)
def marker_offset(entity: EntityRow, event: EventRow, yaw: float, offset: Vector) -> None:
    """Write where the marker is from the entity's centre [world's axes] for a given heading."""
    if entity.at_yaw < 0:
        offset[X], offset[Y], offset[Z] = entity.place_x, entity.place_y, entity.place_z
        return
    offset_in_world(entity.place_x, entity.place_y, entity.place_z, event, yaw, offset)


@kernel(inlined=True)
def marker_point(belief: Belief, event: EventRow, point: Vector, slope: Vector) -> None:
    """Write the subject's marker's centre [world] and its derivative (x, y) by the subject's yaw.

    Without z in the block the marker is at a known height; without yaw it is over the centre; without a block the
    entity stands where its parameters say.
    """
    mean, entity = belief.mean, belief.entities[event.subject]
    start = entity.start
    slope[X] = slope[Y] = 0.0
    point[X], point[Y], point[Z] = entity.place_x, entity.place_y, entity.place_z
    if entity.size == 0:
        return
    if entity.at_yaw >= 0:
        yaw = mean[start + entity.at_yaw]
        marker_offset(entity, event, yaw, point)
        slope[X], slope[Y] = -point[Y], point[X]
    point[X] += mean[start + X]
    point[Y] += mean[start + Y]
    if entity.at_z >= 0:
        point[Z] += mean[start + entity.at_z]


@kernel(inlined=True)
def chain_subject(entity: EntityRow, slope: Vector, by_point: Vector, H: Matrix, row: int) -> None:
    """Write one row of H for the subject's block from the derivative by its marker's point (3)."""
    if entity.size == 0:
        return
    H[row, X], H[row, Y] = by_point[X], by_point[Y]
    if entity.at_z >= 0:
        H[row, entity.at_z] = by_point[Z]
    if entity.at_yaw >= 0:
        H[row, entity.at_yaw] += by_point[X] * slope[X] + by_point[Y] * slope[Y]

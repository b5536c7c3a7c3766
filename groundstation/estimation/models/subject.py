"""The place of an entity's marker, with derivatives by the entity's block: for all sensors that observe one."""

import math
from typing import NamedTuple

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.records import EntityRow, EventRow, X, Y, Z
from groundstation.kernel import kernel

BY_YAW, BY_ROLL, BY_PITCH = range(3)  # rows of derivatives


class Lean(NamedTuple):
    """Roll and pitch of a body [rad]."""

    roll: float
    pitch: float


@kernel(inlined=True)
def lean_of(mean: Vector, entity: EntityRow, event: EventRow) -> Lean:
    """Return the subject's roll and pitch: as reported by its vehicle, plus the error states."""
    roll, pitch = event.subject_roll, event.subject_pitch
    if entity.at_roll_error >= 0:
        roll += mean[entity.start + entity.at_roll_error]
        pitch += mean[entity.start + entity.at_pitch_error]
    return Lean(roll, pitch)


@kernel(inlined=True)
def offset_in_world(x: float, y: float, z: float, lean: Lean, yaw: float, offset: Vector) -> None:
    """Write the offset [world's axes] of a point (x, y, z) of the (leaning) subject [base] from its centre."""
    cr, sr, cp, sp = math.cos(lean.roll), math.sin(lean.roll), math.cos(lean.pitch), math.sin(lean.pitch)
    c, n = math.cos(yaw), math.sin(yaw)
    left, up = cr * y - sr * z, sr * y + cr * z
    forward = cp * x + sp * up
    offset[X], offset[Y], offset[Z] = c * forward - n * left, n * forward + c * left, cp * up - sp * x


@kernel(inlined=True)
def write_slopes(offset: Vector, pitch: float, yaw: float, slopes: Matrix) -> None:
    """Write the derivatives (3, 3) of an offset [world's axes] by yaw, roll and pitch: turns about three axes."""
    c, n, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    forward, left, up = c * offset[X] + n * offset[Y], c * offset[Y] - n * offset[X], offset[Z]
    ahead, aside = sp * left, -sp * forward - cp * up
    slopes[BY_YAW, X], slopes[BY_YAW, Y], slopes[BY_YAW, Z] = -offset[Y], offset[X], 0.0
    slopes[BY_ROLL, X], slopes[BY_ROLL, Y], slopes[BY_ROLL, Z] = c * ahead - n * aside, n * ahead + c * aside, cp * left
    slopes[BY_PITCH, X], slopes[BY_PITCH, Y], slopes[BY_PITCH, Z] = c * up, n * up, -forward


@kernel(inlined=True)
def marker_offset(mean: Vector, entity: EntityRow, event: EventRow, yaw: float, offset: Vector) -> None:
    """Write the offset of the marker from the entity's centre [world's axes] for a given heading."""
    if entity.at_yaw < 0:
        offset[X], offset[Y], offset[Z] = entity.place_x, entity.place_y, entity.place_z
        return
    offset_in_world(entity.place_x, entity.place_y, entity.place_z, lean_of(mean, entity, event), yaw, offset)


@kernel(inlined=True)
def marker_point(belief: Belief, event: EventRow, point: Vector, slopes: Matrix) -> None:
    """Write the subject's marker's centre [world] and its derivatives (3, 3) by the subject's yaw, roll and pitch.

    Without z in the block the marker is at a known height; without yaw it is over the centre; without a block the
    entity is where its parameters say.
    """
    mean, entity = belief.mean, belief.entities[event.subject]
    start = entity.start
    point[X], point[Y], point[Z] = entity.place_x, entity.place_y, entity.place_z
    if entity.size == 0:
        return
    if entity.at_yaw >= 0:
        yaw, lean = mean[start + entity.at_yaw], lean_of(mean, entity, event)
        offset_in_world(entity.place_x, entity.place_y, entity.place_z, lean, yaw, point)
        write_slopes(point, lean.pitch, yaw, slopes)
    point[X] += mean[start + X]
    point[Y] += mean[start + Y]
    if entity.at_z >= 0:
        point[Z] += mean[start + entity.at_z]


@kernel(inlined=True)
def along(direction: Vector, slopes: Matrix, by: int) -> float:
    """Return the derivative of a row by one of the subject's angles, from that by its marker's point (3)."""
    return float(direction[X] * slopes[by, X] + direction[Y] * slopes[by, Y] + direction[Z] * slopes[by, Z])


@kernel(inlined=True)
def chain_subject(entity: EntityRow, slopes: Matrix, by_point: Vector, H: Matrix, row: int) -> None:
    """Write one row of H for the subject's block from the derivative by its marker's point (3)."""
    if entity.size == 0:
        return
    H[row, X], H[row, Y] = by_point[X], by_point[Y]
    if entity.at_z >= 0:
        H[row, entity.at_z] = by_point[Z]
    if entity.at_yaw >= 0:
        H[row, entity.at_yaw] += along(by_point, slopes, BY_YAW)
        if entity.at_roll_error >= 0:
            H[row, entity.at_roll_error] = along(by_point, slopes, BY_ROLL)
            H[row, entity.at_pitch_error] = along(by_point, slopes, BY_PITCH)

"""Parts of motion models, and the loop that calls them; how an entity enters and leaves the state.

Each model predicts the rows of its own block of P, so a step costs O(dim) per entity. `predict` copies them into the
columns, of several entities at once: writing a column of P touches a cache line per row, however few entries of each
are written.
"""

import math
from typing import NamedTuple

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.model_kernels import call_predict
from groundstation.estimation.records import YAW, EntityRow, PriorRow, X, Y, Z
from groundstation.estimation.register_blocks import LANES, add_to_row, add_two_to_row, copy_to_columns, scale_row
from groundstation.kernel import kernel

# Prior of a joining entity about the place by its first measurement: wide against any measurement, yet so that the
# following correction loses no more than eight digits.
DIFFUSE_M2 = 100.0
DIFFUSE_RAD2 = 10.0
_MOST_ROWS = 32  # rows that wait to be copied into columns


@kernel(inlined=True)
def mirror(P: Matrix, start: int, size: int, changed: int) -> None:
    """Make a block exactly symmetric after its first `changed` rows and columns were changed."""
    for i in range(start, start + size):
        for j in range(start, min(i, start + changed)):
            mean = 0.5 * (P[i, j] + P[j, i])
            P[i, j] = mean
            P[j, i] = mean


@kernel(inlined=True)
def add_column(P: Matrix, start: int, size: int, to: int, source: int, factor: float) -> None:
    """Add a multiple of one column to another, within the rows of the block."""
    for i in range(start, start + size):
        P[i, to] += factor * P[i, source]


@kernel()
def depend(P: Matrix, start: int, size: int, to: int, source: int, factor: float) -> None:
    """Let entry `to` of a block gain factor * entry `source`: F P F^T for F = I + factor e_to e_source^T."""
    add_to_row(P, start + to, start + source, factor)
    add_column(P, start, size, start + to, start + source, factor)


class Dependence(NamedTuple):
    """The dependence of an entry of a block on two others: their places in the block, and the factors."""

    a: int
    by_a: float
    b: int
    by_b: float


@kernel(inlined=True)
def depend_on_two(P: Matrix, start: int, size: int, to: int, on: Dependence) -> None:
    """Let entry `to` of a block gain multiples of two others in one pass, as by two calls of `depend`."""
    add_two_to_row(P, start + to, (start + on.a, start + on.b), (on.by_a, on.by_b))
    add_column(P, start, size, start + to, start + on.a, on.by_a)
    add_column(P, start, size, start + to, start + on.b, on.by_b)


@kernel()
def fade(mean: Vector, P: Matrix, start: int, size: int, offset: int, deviation: float, share: float) -> None:
    """Let a Gauss-Markov entry decay towards zero over `share` of its correlation time, keeping its deviation.

    offset -1: the block has no such entry, and nothing happens.
    """
    if offset < 0:
        return
    index, lost = start + offset, math.expm1(-share)
    decay = 1.0 + lost
    mean[index] *= decay
    scale_row(P, index, decay)
    for i in range(start, start + size):
        P[i, index] *= decay
    P[index, index] += deviation * deviation * -lost * (2.0 + lost)  # 1 - decay^2


@kernel(inlined=True)
def wander(P: Matrix, start: int, offset: int, variance: float) -> None:
    """Let an entry wander at random: more variance; offset -1: nothing happens."""
    if offset >= 0:
        P[start + offset, start + offset] += variance


@kernel(inlined=True)
def copy_out(P: Matrix, first: int, stop: int) -> None:
    """Copy some rows into the columns with their numbers, except where both cross."""
    if first == stop:
        return
    copy_to_columns(P, first, stop - first, 0, first)
    copy_to_columns(P, first, stop - first, stop, P.shape[0])


@kernel(inlined=True)
def open_rows(P: Matrix, entity: EntityRow, first: int, stop: int) -> int:
    """Prepare an entity's rows to be moved; returns the first row that is then not yet copied to the columns.

    Rows first..stop were not. They go on waiting if they belong to neighbours whose blocks share cache lines with the
    entity's; the entries that the entity needs are copied to it.
    """
    start, end = entity.start, entity.start + entity.size
    if start != stop or start % LANES == 0 or end - first > _MOST_ROWS:
        copy_out(P, first, stop)
        return int(start)
    copy_to_columns(P, first, start - first, start, end)
    return first


@kernel(inlined=True)
def finish_rows(P: Matrix, entity: EntityRow, first: int) -> int:
    """Copy the entries of an entity's moved rows to neighbours whose rows wait, from `first` on; returns their end."""
    copy_to_columns(P, entity.start, entity.size, first, entity.start)
    return int(entity.start + entity.size)


@kernel()
def predict(belief: Belief, dt: float) -> None:
    """Predict all entities that are in the state, each by its own model's kernel; P stays exactly symmetric."""
    P, first, stop = belief.P, 0, 0
    for e in range(belief.entities.shape[0]):
        entity = belief.entities[e]
        if belief.memory[e].active == 0 or entity.predict == 0:
            continue
        first = open_rows(P, entity, first, stop)
        call_predict(entity.predict, (belief, e, dt))
        stop = finish_rows(P, entity, first)
    copy_out(P, first, stop)


@kernel()
def clear(belief: Belief, e: int) -> None:
    """Take an entity out of the state: zero mean, and no covariance with anything."""
    mean, P, entity = belief.mean, belief.P, belief.entities[e]
    for i in range(entity.start, entity.start + entity.size):
        mean[i] = 0.0
        for j in range(P.shape[0]):
            P[i, j] = 0.0
            P[j, i] = 0.0


@kernel()
def enter(belief: Belief, e: int, prior: PriorRow) -> None:
    """Put an entity into the state by its prior, independent of all others."""
    clear(belief, e)
    entity = belief.entities[e]
    for i in range(entity.size):
        index = entity.start + i
        belief.mean[index] = prior.mean[i]
        belief.P[index, index] = prior.variances[i]


@kernel()
def join(belief: Belief, e: int, prior: PriorRow, pose: Vector) -> None:
    """Put an entity into the state at a pose (x, y, z, yaw) with a diffuse prior, for the following correction.

    The correction turns the diffuse prior into the right covariance and cross-covariances by itself.
    """
    enter(belief, e, prior)
    mean, P, entity = belief.mean, belief.P, belief.entities[e]
    for i in (X, Y):
        mean[entity.start + i] = pose[i]
        P[entity.start + i, entity.start + i] = DIFFUSE_M2
    if entity.at_z >= 0:
        z = entity.start + entity.at_z
        mean[z], P[z, z] = pose[Z], DIFFUSE_M2
    if entity.at_yaw >= 0:
        yaw = entity.start + entity.at_yaw
        mean[yaw], P[yaw, yaw] = pose[YAW], DIFFUSE_RAD2

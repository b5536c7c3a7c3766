"""What motion models are built from, and the loop that calls them; how an entity enters the state and leaves it.

Each model predicts its own block row of P and mirrors it, so a step costs O(dim) per entity.
"""

import math

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.columns import copy_two
from groundstation.estimation.dispatch import call_predict
from groundstation.estimation.kernel import kernel

# Prior of what joins, about the place that its first measurement puts it at: wide against any measurement, yet so
# that the correction which follows loses no more than eight digits.
DIFFUSE_M2 = 100.0
DIFFUSE_RAD2 = 10.0


@kernel("void(float64[:,::1], int64, int64, int64)", inlined=True)
def mirror(P: Array, start: int, size: int, changed: int) -> None:
    """Copy the first `changed` rows of a block onto its columns, so that P stays symmetric to the bit."""
    stop = start + size
    for i in range(start, start + changed - 1, 2):
        copy_two(P, i, 0, start)
        copy_two(P, i, stop, P.shape[0])
    if changed % 2 == 1:
        last = start + changed - 1
        for j in range(start):
            P[j, last] = P[last, j]
        for j in range(stop, P.shape[0]):
            P[j, last] = P[last, j]
    for i in range(start, stop):
        for j in range(start, min(i, start + changed)):
            mean = 0.5 * (P[i, j] + P[j, i])
            P[i, j] = mean
            P[j, i] = mean


@kernel("void(float64[:,::1], int64, int64, float64)")
def add_row(P: Array, to: int, source: int, factor: float) -> None:
    """Add a multiple of one row of P to another."""
    for j in range(P.shape[0]):
        P[to, j] += factor * P[source, j]


@kernel("void(float64[:,::1], int64, int64, int64, int64, float64)", inlined=True)
def add_column(P: Array, start: int, size: int, to: int, source: int, factor: float) -> None:
    """Add a multiple of one column to another, within the rows of the block."""
    for i in range(start, start + size):
        P[i, to] += factor * P[i, source]


@kernel("void(float64[:,::1], int64, int64, int64, int64, float64)")
def depend(P: Array, start: int, size: int, to: int, source: int, factor: float) -> None:
    """Let entry `to` of a block gain factor * entry `source`: F P F^T for F = I + factor e_to e_source^T."""
    add_row(P, start + to, start + source, factor)
    add_column(P, start, size, start + to, start + source, factor)


@kernel("void(float64[::1], float64[:,::1], int64, int64, int64, float64, float64)")
def fade(mean: Array, P: Array, start: int, size: int, offset: int, deviation: float, share: float) -> None:
    """Let a Gauss-Markov entry decay towards zero over `share` of its correlation time, keeping its deviation.

    offset -1: the block has no such entry, and nothing happens.
    """
    if offset < 0:
        return
    index, decay = start + offset, math.exp(-share)
    mean[index] *= decay
    for j in range(P.shape[0]):
        P[index, j] *= decay
    for i in range(start, start + size):
        P[i, index] *= decay
    P[index, index] += deviation * deviation * -math.expm1(-2.0 * share)


@kernel("void(float64[:,::1], int64, int64, float64)", inlined=True)
def wander(P: Array, start: int, offset: int, variance: float) -> None:
    """Let an entry wander at random: more variance; offset -1: nothing happens."""
    if offset >= 0:
        P[start + offset, start + offset] += variance


@kernel("void(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1], float64)", inlined=True)
def predict(mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, dt: float) -> None:
    """Predict all entities that are in the state, each by its own model's kernel."""
    for e in range(entities.shape[0]):
        if aux[e, s.ACTIVE] != 0.0 and entities[e, s.ENTITY_PREDICT] != 0:
            call_predict(entities[e, s.ENTITY_PREDICT], (mean, P, entities, parameters, aux, e, dt))


@kernel("void(float64[::1], float64[:,::1], int64[::1])")
def clear(mean: Array, P: Array, entity: IntArray) -> None:
    """Take an entity out of the state: zero mean, and no covariance with anything."""
    for i in range(entity[s.ENTITY_START], entity[s.ENTITY_START] + entity[s.ENTITY_SIZE]):
        mean[i] = 0.0
        for j in range(P.shape[0]):
            P[i, j] = 0.0
            P[j, i] = 0.0


@kernel("void(float64[::1], float64[:,::1], int64[::1], float64[:,::1])")
def enter(mean: Array, P: Array, entity: IntArray, prior: Array) -> None:
    """Put an entity into the state as its prior says (rows: mean, variances), independent of all others."""
    clear(mean, P, entity)
    for i in range(entity[s.ENTITY_SIZE]):
        index = entity[s.ENTITY_START] + i
        mean[index] = prior[0, i]
        P[index, index] = prior[1, i]


@kernel("void(float64[::1], float64[:,::1], int64[::1], float64[:,::1], float64[::1])")
def join(mean: Array, P: Array, entity: IntArray, prior: Array, pose: Array) -> None:
    """Put an entity into the state at a pose (x, y, z, yaw) with a diffuse prior, for the correction that follows.

    The correction turns the diffuse prior into the right covariance and cross-covariances by itself.
    """
    enter(mean, P, entity, prior)
    start = entity[s.ENTITY_START]
    for i in range(2):
        mean[start + i] = pose[i]
        P[start + i, start + i] = DIFFUSE_M2
    if entity[s.AT_Z] >= 0:
        z = start + entity[s.AT_Z]
        mean[z], P[z, z] = pose[2], DIFFUSE_M2
    if entity[s.AT_YAW] >= 0:
        yaw = start + entity[s.AT_YAW]
        mean[yaw], P[yaw, yaw] = pose[3], DIFFUSE_RAD2

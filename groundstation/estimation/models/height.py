"""Height sensor: z + its slow error - the height of the object below, condensed to one value per step.

Over an object the height falls by the object's height while the vehicle does not move. A jump of such a size that the
belief cannot explain is attributed to the floor: the floor entry is reset and takes the jump; the vehicle stays.
"""

import math
from typing import NamedTuple

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.deferred import make, put_off
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.kernel import kernel

# Deviations of the floor under the vehicle: even floor, an object of unknown height on it; and the least object [m].
EVEN_M = 0.005
OBJECT_M = 0.5
LEAST_OBJECT_M = 0.1


class HeightEntries(NamedTuple):
    """State indices of z, the sensor's slow error and the floor; -1: not in the block (z always is)."""

    z: int
    error: int
    floor: int


@kernel()
def forget(mean: Vector, P: Matrix, index: int, deviation: float) -> None:
    """Reset one entry: zero mean, the given deviation, independent of all others."""
    mean[index] = 0.0
    for j in range(P.shape[0]):
        P[index, j] = 0.0
        P[j, index] = 0.0
    P[index, index] = deviation * deviation


@kernel()
def height_of(x: Vector, at: HeightEntries) -> float:
    """Return H x, that is z + error - floor (without entries missing in the block)."""
    value = float(x[at.z])
    if at.error >= 0:
        value += x[at.error]
    if at.floor >= 0:
        value -= x[at.floor]
    return value


@kernel()
def project_height(P: Matrix, deferred: Deferred, at: HeightEntries, W: Vector) -> float:
    """Write H P into W and return H P H^T."""
    n = P.shape[0]
    for j in range(n):
        W[j] = P[at.z, j]
    if at.error >= 0:
        for j in range(n):
            W[j] += P[at.error, j]
    if at.floor >= 0:
        for j in range(n):
            W[j] -= P[at.floor, j]
    for q in range(deferred.used[0]):
        v = deferred.V[q]
        f = height_of(v, at)
        for j in range(n):
            W[j] -= f * v[j]
    return height_of(W, at)


@kernel()
def attribute_jump(
    belief: Belief, deferred: Deferred, at: HeightEntries, height: float, R: float, gate: float, W: Vector
) -> float:
    """Attribute a height beyond the gate to the floor: the even floor again, else an object; returns H P H^T."""
    mean, P = belief.mean, belief.P
    variance = project_height(P, deferred, at, W)
    y = height - height_of(mean, at)
    if at.floor < 0 or y * y <= max(gate * (variance + R), LEAST_OBJECT_M * LEAST_OBJECT_M):
        return variance
    make(P, deferred)
    forget(mean, P, at.floor, EVEN_M)
    variance = project_height(P, deferred, at, W)
    y = height - height_of(mean, at)
    if y * y > gate * (variance + R):
        forget(mean, P, at.floor, OBJECT_M)
        variance = project_height(P, deferred, at, W)
    return variance


@kernel()
def correct_height(belief: Belief, deferred: Deferred, at: HeightEntries, height: float, R: float, gate: float) -> None:
    """Correct by one height, softly gated.

    As in correction.apply: P - W^T W / S, deferred.
    """
    mean, n = belief.mean, belief.P.shape[0]
    W = np.empty(n)
    S = attribute_jump(belief, deferred, at, height, R, gate, W) + R
    y = height - height_of(mean, at)
    if y * y > gate * S:
        S = y * y / gate
    root = math.sqrt(S)
    v = deferred.V[put_off(belief.P, deferred, 1)]
    for j in range(n):
        v[j] = W[j] / root
        mean[j] += v[j] * (y / root)

"""Height sensor: z + its slow error - the height of what is below, condensed to one value per step.

Over an object the height falls by the object's height while the vehicle does not move. A jump of this size that the
belief cannot explain is the floor's: the floor entry forgets what it knew and takes the jump; the vehicle stays.
"""

import math
from typing import NamedTuple

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.kernel import kernel

# Deviations of the floor under the vehicle: even floor, an object of unknown height on it; and the least object [m].
EVEN_M = 0.005
OBJECT_M = 0.5
LEAST_OBJECT_M = 0.1


class HeightEntries(NamedTuple):
    """Where in the state z, the sensor's slow error and the floor stand; -1: the block lacks it (z it has)."""

    z: int
    error: int
    floor: int


@kernel()
def forget(mean: Vector, P: Matrix, index: int, deviation: float) -> None:
    """Replace what is known of one entry: zero mean, the given deviation, independent of all others."""
    mean[index] = 0.0
    for j in range(P.shape[0]):
        P[index, j] = 0.0
        P[j, index] = 0.0
    P[index, index] = deviation * deviation


@kernel()
def project_height(P: Matrix, at: HeightEntries, W: Vector) -> float:
    """Write H P into W for H x = z + error - floor (entries that the block lacks left out) and return H P H^T."""
    for j in range(P.shape[0]):
        W[j] = P[at.z, j]
    if at.error >= 0:
        for j in range(P.shape[0]):
            W[j] += P[at.error, j]
    if at.floor >= 0:
        for j in range(P.shape[0]):
            W[j] -= P[at.floor, j]
    variance = float(W[at.z])
    if at.error >= 0:
        variance += W[at.error]
    if at.floor >= 0:
        variance -= W[at.floor]
    return variance


@kernel()
def height_of(mean: Vector, at: HeightEntries) -> float:
    """Return h(x)."""
    value = float(mean[at.z])
    if at.error >= 0:
        value += mean[at.error]
    if at.floor >= 0:
        value -= mean[at.floor]
    return value


@kernel()
def attribute_jump(
    mean: Vector, P: Matrix, at: HeightEntries, height: float, R: float, gate: float, W: Vector
) -> float:
    """Let the floor take up a height that is beyond the gate: the even floor again, else an object; returns H P H^T."""
    variance = project_height(P, at, W)
    y = height - height_of(mean, at)
    if at.floor < 0 or y * y <= max(gate * (variance + R), LEAST_OBJECT_M * LEAST_OBJECT_M):
        return variance
    forget(mean, P, at.floor, EVEN_M)
    variance = project_height(P, at, W)
    y = height - height_of(mean, at)
    if y * y > gate * (variance + R):
        forget(mean, P, at.floor, OBJECT_M)
        variance = project_height(P, at, W)
    return variance


@kernel()
def correct_height(mean: Vector, P: Matrix, at: HeightEntries, height: float, R: float, gate: float) -> None:
    """Correct by one height, softly gated.

    As in correction.apply: P - W^T W / S.
    """
    n = P.shape[0]
    W = np.empty(n)
    S = attribute_jump(mean, P, at, height, R, gate, W) + R
    y = height - height_of(mean, at)
    if y * y > gate * S:
        S = y * y / gate
    root = math.sqrt(S)
    for j in range(n):
        W[j] /= root
        mean[j] += W[j] * (y / root)
    for i in range(n):
        row, v = P[i], W[i]
        for j in range(n):
            row[j] -= v * W[j]

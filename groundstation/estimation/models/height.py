"""Height sensor: z + its slow error - the height of what is below, condensed to one value per step.

Over an object the height falls by the object's height while the vehicle does not move. A jump of this size that the
belief cannot explain is the floor's: the floor entry forgets what it knew and takes the jump; the vehicle stays.
"""

import math

import numpy as np

from groundstation.estimation.belief import Array
from groundstation.estimation.kernel import kernel

# Deviations of the floor under the vehicle: even floor, an object of unknown height on it; and the least object [m].
EVEN_M = 0.005
OBJECT_M = 0.5
LEAST_OBJECT_M = 0.1


@kernel("void(float64[::1], float64[:,::1], int64, float64)")
def forget(mean: Array, P: Array, index: int, deviation: float) -> None:
    """Replace what is known of one entry: zero mean, the given deviation, independent of all others."""
    mean[index] = 0.0
    for j in range(P.shape[0]):
        P[index, j] = 0.0
        P[j, index] = 0.0
    P[index, index] = deviation * deviation


@kernel("float64(float64[::1], float64[:,::1], int64, int64, int64, float64[::1])")
def project_height(mean: Array, P: Array, z: int, error: int, floor: int, W: Array) -> float:
    """Write H P into W for H x = z + error - floor (entries of index < 0 left out) and return H P H^T."""
    for j in range(P.shape[0]):
        W[j] = P[z, j]
    if error >= 0:
        for j in range(P.shape[0]):
            W[j] += P[error, j]
    if floor >= 0:
        for j in range(P.shape[0]):
            W[j] -= P[floor, j]
    variance = float(W[z])
    if error >= 0:
        variance += W[error]
    if floor >= 0:
        variance -= W[floor]
    return variance


@kernel("float64(float64[::1], int64, int64, int64)")
def height_of(mean: Array, z: int, error: int, floor: int) -> float:
    """Return h(x)."""
    value = float(mean[z])
    if error >= 0:
        value += mean[error]
    if floor >= 0:
        value -= mean[floor]
    return value


@kernel("float64(float64[::1], float64[:,::1], int64, int64, int64, float64, float64, float64, float64[::1])")
def attribute_jump(
    mean: Array, P: Array, z: int, error: int, floor: int, height: float, R: float, gate: float, W: Array
) -> float:
    """Let the floor take up a height that is beyond the gate: the even floor again, else an object; returns H P H^T."""
    variance = project_height(mean, P, z, error, floor, W)
    y = height - height_of(mean, z, error, floor)
    if floor < 0 or y * y <= max(gate * (variance + R), LEAST_OBJECT_M * LEAST_OBJECT_M):
        return variance
    forget(mean, P, floor, EVEN_M)
    variance = project_height(mean, P, z, error, floor, W)
    y = height - height_of(mean, z, error, floor)
    if y * y > gate * (variance + R):
        forget(mean, P, floor, OBJECT_M)
        variance = project_height(mean, P, z, error, floor, W)
    return variance


@kernel("void(float64[::1], float64[:,::1], int64, int64, int64, float64, float64, float64)")
def correct_height(mean: Array, P: Array, z: int, error: int, floor: int, height: float, R: float, gate: float) -> None:
    """Correct by one height, softly gated; indices into the state, -1 for entries that the block lacks.

    As in correction.apply: P - W^T W / S.
    """
    n = P.shape[0]
    W = np.empty(n)
    S = attribute_jump(mean, P, z, error, floor, height, R, gate, W) + R
    y = height - height_of(mean, z, error, floor)
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

"""Small dense linear algebra in compiled loops: up to 4 rows per measurement, and the whole P once a tick."""

import math

from groundstation.arrays import Matrix
from groundstation.kernel import kernel


@kernel(inlined=True)
def wrap(angle: float) -> float:
    """Return the same direction in [-pi, pi]; exact enough for sums of a few turns."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@kernel()
def copy_matrix(source: Matrix, to: Matrix) -> None:
    """Copy one matrix into another of its shape; written out, since slice assignment takes seconds to compile."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            to[i, j] = source[i, j]


@kernel(inlined=True)
def cholesky(matrix: Matrix, size: int) -> bool:
    """Overwrite the lower triangle of the leading block with its Cholesky factor; False if it is not PD."""
    for column in range(size):
        pivot = matrix[column, column]
        for k in range(column):
            pivot -= matrix[column, k] * matrix[column, k]
        if not (pivot > 0.0 and pivot < math.inf):
            return False
        root = math.sqrt(pivot)
        matrix[column, column] = root
        for row in range(column + 1, size):
            value = matrix[row, column]
            for k in range(column):
                value -= matrix[row, k] * matrix[column, k]
            matrix[row, column] = value / root
    return True

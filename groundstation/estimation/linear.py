"""Small dense linear algebra in compiled loops: up to 4 rows per measurement, and the whole P once a tick."""

import math
from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

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


_LANES = 8


def _eight_entries(_typing: Any, P: Any, row: Any, first: Any) -> Any:
    """Copy `_LANES` entries of two rows, from column `first` on, into the two columns of the same numbers.

    Spelled out, since the compiler makes single stores of it: the two columns are neighbours, and take one.
    """

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        matrix = context.make_array(signature.args[0])(context, builder, values[0])
        at, start = values[1:]
        width = builder.extract_value(matrix.shape, 1)

        def entries(i: Any, j: Any, count: int) -> Any:
            place = builder.gep(matrix.data, [builder.add(builder.mul(i, width), j)])
            return builder.bitcast(place, ir.VectorType(ir.DoubleType(), count).as_pointer())

        def picked(a: Any, b: Any, places: list[int]) -> Any:
            return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), len(places)), places))

        rows = [builder.add(at, ir.Constant(at.type, i)) for i in range(2)]
        a, b = (builder.load(entries(i, start, _LANES), align=8) for i in rows)
        halves = [picked(a, b, [i + k for k in range(h, _LANES, 2) for i in (0, _LANES)]) for h in range(2)]
        for k in range(_LANES):
            pair = picked(halves[k % 2], halves[k % 2], [k - k % 2, k - k % 2 + 1])
            builder.store(pair, entries(builder.add(start, ir.Constant(start.type, k)), at, 2), align=8)
        return context.get_dummy_value()

    return types.void(P, types.int64, types.int64), generate


_copy_eight = cast(Callable[..., None], intrinsic(_eight_entries))


@kernel(inlined=True)
def copy_two(P: Matrix, row: int, first: int, last: int) -> None:
    """Copy columns first..last of rows `row` and `row + 1` into the columns `row` and `row + 1`.

    Two at a time: half of the cost of a prediction.
    """
    whole = first + (last - first) // _LANES * _LANES
    for j in range(first, whole, _LANES):
        _copy_eight(P, row, j)
    for j in range(whole, last):
        P[j, row] = P[row, j]
        P[j, row + 1] = P[row + 1, j]

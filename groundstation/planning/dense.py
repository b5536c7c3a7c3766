"""Cholesky factor and products of small matrices, four rows at a time, in compiled code.

Matrices are C-ordered, padded to a multiple of 8 rows (identity in the padding), and only the upper triangle counts;
entries below the diagonal are neither used nor cleared.
"""

import math
from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from groundstation.arrays import Matrix
from groundstation.estimation.register_blocks import LANES, reflect
from groundstation.kernel import kernel
from groundstation.planning.lanes import Lanes, in_lanes, index, nothing, repeated

PIVOTS = 4


@kernel(inlined=True)
def padded(size: int) -> int:
    """Return the next multiple of the vector width."""
    return -(-size // LANES) * LANES


@intrinsic
def _typed_rank4(
    _typing: Any, target: Any, panel: Any, stride: Any, factors: Any, factor_stride: Any, row_stride: Any, blocks: Any
) -> Any:
    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        """Emit: for each block of 8 columns, for 4 rows r: target[r] -= sum_p factor[p, r] * panel[p]."""
        target, panel, stride, factors, factor_stride, row_stride, blocks = args
        vector, pointer = ir.VectorType(ir.DoubleType(), LANES), ir.IntType(64)
        whole = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)

        def address(base: Any, index: int, stride: Any) -> Any:
            return builder.add(base, builder.mul(stride, ir.Constant(pointer, index)))

        def scalar(base: Any) -> Any:
            value = builder.load(builder.inttoptr(base, ir.DoubleType().as_pointer()))
            first = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
            return builder.shuffle_vector(first, ir.Constant(vector, ir.Undefined), whole)

        def lanes(base: Any) -> Any:
            return builder.inttoptr(base, vector.as_pointer())

        held = [
            [scalar(address(address(factors, p, factor_stride), r, row_stride)) for r in range(4)]
            for p in range(PIVOTS)
        ]
        with cgutils.for_range(builder, blocks) as loop:
            column = builder.mul(loop.index, ir.Constant(pointer, 8 * LANES))
            rows = [builder.load(lanes(builder.add(address(panel, p, stride), column)), align=8) for p in range(4)]
            for r in range(4):
                place = lanes(builder.add(address(target, r, stride), column))
                value = builder.load(place, align=8)
                for p in range(PIVOTS):
                    product = builder.fmul(held[p][r], rows[p], flags=["contract"])
                    value = builder.fsub(value, product, flags=["contract"])
                builder.store(value, place, align=8)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 7), code


_rank4 = cast(Callable[[int, int, int, int, int, int, int], None], _typed_rank4)


@kernel()
def subtract_outer(matrix: Matrix, panel: int, factors: int, first: int, end: int) -> None:
    """Subtract sum_p factors[p] panel[p] (addresses of 4 rows each) from some rows of the upper triangle."""
    m = matrix.shape[0]
    stride, base = m * 8, matrix.ctypes.data
    for i in range(first, end, 4):
        column = i & ~7
        blocks = (m - column) >> 3
        _rank4(base + i * stride + column * 8, panel + column * 8, stride, factors + i * 8, stride, 8, blocks)


@kernel()
def subtract_products(target: Matrix, matrix: Matrix, columns: Matrix, count: int) -> None:
    """Subtract matrix @ column from target for the first `count` rows of columns; matrix (m, m) symmetric and full.

    target and columns (>= count, m) hold one column per row, with 3 spare rows: rows are processed in fours.
    """
    m = matrix.shape[0]
    stride = m * 8
    for c in range(0, count, 4):
        for a in range(0, m, 4):
            factors = columns.ctypes.data + c * stride + a * 8
            _rank4(target.ctypes.data + c * stride, matrix.ctypes.data + a * stride, stride, factors, 8, stride, m >> 3)


@in_lanes
def _write_block(b: Any, A: Any, B: Any, C: Any, row: Any, column: Any) -> None:
    """Write the 8 x 8 block of A^T B that begins at (row, column) to C."""

    def add(k: Any, sums: list[Lanes]) -> list[Lanes]:
        factors = B.read(k, column)
        return [total.plus(A.one(k, b.add(row, index(i))).times(factors)) for i, total in enumerate(sums)]

    for i, total in enumerate(repeated(b, A.shape(0), [nothing(b)] * LANES, add)):
        C.write(total, b.add(row, index(i)), column)


@kernel()
def multiply(A: Matrix, B: Matrix, C: Matrix) -> None:
    """C <- A^T B, in blocks that stay in registers."""
    for row in range(0, C.shape[0], LANES):
        for column in range(0, C.shape[1], LANES):
            _write_block(A, B, C, row, column)


@kernel()
def multiply_to_symmetric(A: Matrix, B: Matrix, C: Matrix) -> None:
    """C <- A^T B where that is symmetric: one half, copied to the other."""
    for row in range(0, C.shape[0], LANES):
        for column in range(row, C.shape[1], LANES):
            _write_block(A, B, C, row, column)
    reflect(C)


@kernel()
def copy_upper(matrix: Matrix) -> None:
    """Copy the upper triangle to the lower one."""
    reflect(matrix)
    for k in range(0, matrix.shape[0], LANES):
        for i in range(k, k + LANES):
            for j in range(k, i):
                matrix[i, j] = matrix[j, i]


@kernel(contract=True)
def cholesky_upper(matrix: Matrix) -> bool:
    """Factor A = U^T U in place; False when a pivot is not positive (or not a number)."""
    m = matrix.shape[0]
    for k in range(0, m, 4):
        p00 = matrix[k, k]
        d0 = 1.0 / math.sqrt(p00)
        u01, u02, u03 = matrix[k, k + 1] * d0, matrix[k, k + 2] * d0, matrix[k, k + 3] * d0
        p11 = matrix[k + 1, k + 1] - u01 * u01
        d1 = 1.0 / math.sqrt(p11)
        u12, u13 = (matrix[k + 1, k + 2] - u01 * u02) * d1, (matrix[k + 1, k + 3] - u01 * u03) * d1
        p22 = matrix[k + 2, k + 2] - u02 * u02 - u12 * u12
        d2 = 1.0 / math.sqrt(p22)
        u23 = (matrix[k + 2, k + 3] - u02 * u03 - u12 * u13) * d2
        p33 = matrix[k + 3, k + 3] - u03 * u03 - u13 * u13 - u23 * u23
        if not (p00 > 0.0 and p11 > 0.0 and p22 > 0.0 and p33 > 0.0):
            return False
        d3 = 1.0 / math.sqrt(p33)
        for j in range(k & ~7, m):
            a = matrix[k, j] * d0
            b = (matrix[k + 1, j] - u01 * a) * d1
            c = (matrix[k + 2, j] - u02 * a - u12 * b) * d2
            d = (matrix[k + 3, j] - u03 * a - u13 * b - u23 * c) * d3
            matrix[k, j], matrix[k + 1, j], matrix[k + 2, j], matrix[k + 3, j] = a, b, c, d
        subtract_outer(matrix, matrix.ctypes.data + k * m * 8, matrix.ctypes.data + k * m * 8, k + 4, m)
    return True

"""Inverses and columns of them, of small positive definite matrices, four pivots at a time, in compiled code.

Matrices are as in `dense`: C-ordered, padded to a multiple of 8 rows, and only the upper triangle counts. An inverse
of 31 x 31 takes 1.2 us, LAPACK's 4.3 us.
"""

from typing import Any, NamedTuple

from groundstation.arrays import Matrix, MatrixStack
from groundstation.kernel import kernel
from groundstation.planning.dense import subtract_outer
from groundstation.planning.lanes import (
    LANES,
    Lanes,
    columns_of_fours,
    eights,
    fours_of_columns,
    in_lanes,
    index,
    nothing,
    repeated,
)


class Pivots(NamedTuple):
    """The inverse of a symmetric 4 x 4 block of pivots; sound: False when one of them is not positive."""

    sound: bool
    b00: float
    b01: float
    b02: float
    b03: float
    b11: float
    b12: float
    b13: float
    b22: float
    b23: float
    b33: float


@kernel(inlined=True, contract=True)
def invert_pivots(matrix: Matrix, k: int) -> Pivots:
    """Return the inverse of the block at row k, of whose entries the upper ones are read.

    [[A, E], [E^T, F]] is inverted by its 2 x 2 blocks: A^-1 = p, X = p E, (F - E^T X)^-1 = q.
    """
    a00, a01, a11 = matrix[k, k], matrix[k, k + 1], matrix[k + 1, k + 1]
    det = a00 * a11 - a01 * a01
    p00, p01, p11 = a11 / det, -a01 / det, a00 / det
    e00, e01, e10, e11 = matrix[k, k + 2], matrix[k, k + 3], matrix[k + 1, k + 2], matrix[k + 1, k + 3]
    x00, x01 = p00 * e00 + p01 * e10, p00 * e01 + p01 * e11
    x10, x11 = p01 * e00 + p11 * e10, p01 * e01 + p11 * e11
    s00, s01 = matrix[k + 2, k + 2] - e00 * x00 - e10 * x10, matrix[k + 2, k + 3] - e00 * x01 - e10 * x11
    s11 = matrix[k + 3, k + 3] - e01 * x01 - e11 * x11
    rest = s00 * s11 - s01 * s01
    b22, b23, b33 = s11 / rest, -s01 / rest, s00 / rest
    b02, b03 = -(x00 * b22 + x01 * b23), -(x00 * b23 + x01 * b33)
    b12, b13 = -(x10 * b22 + x11 * b23), -(x10 * b23 + x11 * b33)
    b00, b01 = p00 - b02 * x00 - b03 * x01, p01 - b02 * x10 - b03 * x11
    sound = a00 > 0.0 and det > 0.0 and s00 > 0.0 and rest > 0.0
    return Pivots(sound, b00, b01, b02, b03, p11 - b12 * x10 - b13 * x11, b12, b13, b22, b23, b33)


def _products(given: list[Lanes], pivots: Any) -> list[Lanes]:
    """Return the inverse pivots times four rows."""
    p, products = pivots, []
    for factors in ((p.b00, p.b01, p.b02, p.b03), (p.b01, p.b11, p.b12, p.b13), (p.b02, p.b12, p.b22, p.b23),
                    (p.b03, p.b13, p.b23, p.b33)):  # fmt: skip
        total = given[0].times(factors[0])
        for row, factor in zip(given[1:], factors[1:], strict=True):
            total = total.plus(row.times(factor))
        products.append(total)
    return products


@in_lanes
def _multiply(b: Any, matrix: Any, k: Any, panel: Any, product: Any, to: Any, first: Any, pivots: Pivots) -> None:
    """Copy four rows, from a column on, into the panel's last four, and write the inverse pivots times them."""

    def eight(more: Any, carried: list[Lanes]) -> list[Lanes]:
        at = b.add(first, b.mul(more, index(LANES)))
        given = [matrix.read(b.add(k, index(p)), at) for p in range(4)]
        for p, product_of in enumerate(_products(given, pivots)):
            panel.write(given[p], index(4 + p), at)
            product.write(product_of, b.add(to, index(p)), at)
        return carried

    repeated(b, eights(b, first, matrix.shape(1)), [], eight)


@in_lanes
def _collect(b: Any, matrix: Any, k: Any, panel: Any, pivots: Pivots) -> None:
    """Do as `_multiply` with the four rows that stand in columns as far as the pivots, up to the end of their eight."""

    def eight(block: Any, carried: list[Lanes]) -> list[Lanes]:
        at = b.mul(block, index(LANES))
        above = columns_of_fours(b, [matrix.read_four(b.add(at, index(i)), k) for i in range(LANES)])
        given = []
        for p in range(4):
            row = b.add(k, index(p))
            given.append(above[p].before(b.sub(row, at), matrix.read(row, at)))
        for p, product in enumerate(_products(given, pivots)):
            panel.write(given[p], index(4 + p), at)
            panel.write(product, index(p), at)
        return carried

    repeated(b, b.add(b.lshr(k, index(3)), index(1)), [], eight)


@in_lanes
def _distribute(b: Any, panel: Any, matrix: Any, k: Any) -> None:
    """Copy four rows of the panel into columns of the matrix, as far as the pivots."""

    def eight(block: Any, carried: list[Lanes]) -> list[Lanes]:
        at = b.mul(block, index(LANES))
        rows = [panel.read(index(p), at) for p in range(4)]
        for i, four in enumerate(fours_of_columns(b, rows)):
            matrix.write_four(four, b.add(at, index(i)), k)
        return carried

    repeated(b, eights(b, index(0), k), [], eight)


@in_lanes
def _copy_rows(b: Any, rows: Any, row: Any, copies: Any, to: Any, first: Any) -> None:
    """Copy four rows from a column on."""

    def eight(k: Any, carried: list[Lanes]) -> list[Lanes]:
        at = b.add(first, b.mul(k, index(LANES)))
        for p in range(4):
            copies.write(rows.read(b.add(row, index(p)), at), b.add(to, index(p)), at)
        return carried

    repeated(b, eights(b, first, rows.shape(1)), [], eight)


@kernel(inlined=True)
def _put(pivots: Pivots, matrix: Matrix, k: int, sign: float) -> None:
    """Write the inverse pivots, or minus them, into the upper entries of the block at row k."""
    b = pivots
    matrix[k, k], matrix[k, k + 1], matrix[k, k + 2], matrix[k, k + 3] = (
        sign * b.b00, sign * b.b01, sign * b.b02, sign * b.b03,
    )  # fmt: skip
    matrix[k + 1, k + 1], matrix[k + 1, k + 2], matrix[k + 1, k + 3] = sign * b.b11, sign * b.b12, sign * b.b13
    matrix[k + 2, k + 2], matrix[k + 2, k + 3], matrix[k + 3, k + 3] = sign * b.b22, sign * b.b23, sign * b.b33


@kernel(inlined=True)
def eliminate_pivots(matrix: Matrix, panel: Matrix, k: int, pivots: Pivots) -> None:
    """Eliminate four rows from those below: A = U^T B^-1 U, B the inverse pivots, and U, with ones, in place of A.

    In the blocks of pivots, where U has ones and zeros, stand the blocks of B. panel (8, m) is scratch.
    """
    m = matrix.shape[0]
    _multiply(matrix, k, panel, matrix, k, k & ~7, pivots)
    subtract_outer(matrix, matrix.ctypes.data + k * m * 8, panel.ctypes.data + 4 * m * 8, k + 4, m)
    _put(pivots, matrix, k, 1.0)


@kernel(inlined=True)
def sweep_pivots(matrix: Matrix, panel: Matrix, k: int, pivots: Pivots) -> None:
    """Sweep four rows; once all are swept, the matrix is -A^-1.

    panel (8, m) is scratch: the inverse pivots times the four rows, then these rows themselves.
    """
    m = matrix.shape[0]
    _collect(matrix, k, panel, pivots)
    _multiply(matrix, k, panel, panel, 0, (k | 7) + 1, pivots)
    factors = panel.ctypes.data + 4 * m * 8
    subtract_outer(matrix, panel.ctypes.data, factors, 0, k)
    subtract_outer(matrix, panel.ctypes.data, factors, k + 4, m)
    _distribute(panel, matrix, k)
    _copy_rows(panel, 0, matrix, k, k & ~7)
    _put(pivots, matrix, k, -1.0)


@kernel()
def negative_inverse(matrix: Matrix, panel: Matrix) -> bool:
    """Replace A by -A^-1 (symmetric sweeps, four pivots at a time); False when a pivot is not positive.

    panel (8, m) is scratch.
    """
    for k in range(0, matrix.shape[0], 4):
        pivots = invert_pivots(matrix, k)
        if not pivots.sound:
            return False
        sweep_pivots(matrix, panel, k, pivots)
    return True


@kernel()
def eliminate(matrix: Matrix, panel: Matrix) -> bool:
    """Replace A by its factors as `eliminate_pivots` does; False when a pivot is not positive.

    panel (8, m) is scratch.
    """
    for k in range(0, matrix.shape[0], 4):
        pivots = invert_pivots(matrix, k)
        if not pivots.sound:
            return False
        eliminate_pivots(matrix, panel, k, pivots)
    return True


@kernel()
def eliminate_and_invert(matrix: Matrix, square: Matrix, panel: Matrix) -> bool:
    """Do as `eliminate` with one matrix and as `negative_inverse` with another, side by side.

    A pivot must wait for the one before; two matrices wait together.
    """
    for k in range(0, matrix.shape[0], 4):
        pivots, swept = invert_pivots(matrix, k), invert_pivots(square, k)
        if not (pivots.sound and swept.sound):
            return False
        eliminate_pivots(matrix, panel, k, pivots)
        sweep_pivots(square, panel, k, swept)
    return True


@in_lanes
def _substitute(b: Any, factors: Any, columns: Any, i: Any, c: Any, k: Any) -> None:
    """Write four entries of a column from those behind them; all before are zero."""
    first = b.and_(k, index(~7))

    def eight(more: Any, sums: list[Lanes]) -> list[Lanes]:
        at = b.add(first, b.mul(more, index(LANES)))
        behind = columns.read(i, c, at)
        return [sums[p].minus(factors.read(i, b.add(k, index(p)), at).times(behind)) for p in range(4)]

    sums = repeated(b, eights(b, first, columns.shape(2)), [nothing(b)] * 4, eight)
    for p, total in enumerate(sums):
        columns.put(total.sum(), i, c, b.add(k, index(p)))


@kernel()
def solve_for_columns(factors: MatrixStack, columns: MatrixStack, last: int) -> None:
    """Write column `last` of each A_i^-1, that many rows long, into columns[i, h - 1 - i]; factors by `eliminate`.

    All together, four entries of each at a time: an entry must wait for the one behind.
    """
    steps, m, end = factors.shape[0], factors.shape[1], last & ~3
    for i in range(steps):
        own = steps - 1 - i
        for a in range(m):
            columns[i, own, a] = 0.0
        for a in range(end, last + 1):
            columns[i, own, a] = factors[i, a, last]
    for k in range(end - 4, -1, -4):
        for i in range(steps):
            _substitute(factors, columns, i, steps - 1 - i, k)

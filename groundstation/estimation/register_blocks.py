"""Matrix operations in blocks that stay in vector registers, the bulk of predictions and corrections; compiled.

Rows are as long as a multiple of 8 numbers. Products are added in one rounding (`contract`), one after the other in the
order of the factors' rows.
"""

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from groundstation.arrays import IntVector, Matrix
from groundstation.kernel import kernel

LANES = 8
ROWS = 4  # rows that `add_rows` and `subtract_rows` work on
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)


class _Builder:
    """Writes instructions on blocks of the arrays among an intrinsic's arguments."""

    def __init__(self, context: Any, builder: Any, signature: Any, values: Any) -> None:
        self.builder = builder
        self._arrays = {
            i: context.make_array(kind)(context, builder, values[i])
            for i, kind in enumerate(signature.args)
            if isinstance(kind, types.Array)
        }

    def plus(self, value: Any, more: int) -> Any:
        """Return an index that is larger by a constant."""
        return self.builder.add(value, ir.Constant(value.type, more))

    def place(self, argument: int, i: Any, j: Any, kind: Any = _VECTOR) -> Any:
        """Return the address of entry (i, j) of a matrix."""
        array, builder = self._arrays[argument], self.builder
        width = builder.extract_value(array.shape, 1)
        at = builder.gep(array.data, [builder.add(builder.mul(i, width), j)])
        return builder.bitcast(at, kind.as_pointer())

    def entry(self, argument: int, i: Any) -> Any:
        """Return entry i of a vector."""
        return self.builder.load(self.builder.gep(self._arrays[argument].data, [i]))

    def filled(self, number: Any) -> Any:
        """Return a number in all lanes."""
        nothing, first = ir.Constant(_VECTOR, ir.Undefined), ir.Constant(ir.IntType(32), 0)
        one = self.builder.insert_element(nothing, number, first)
        return self.shuffled(one, one, [0] * LANES)

    def everywhere(self, place: Any) -> Any:
        """Return the number at a place in all lanes."""
        return self.filled(self.builder.load(place))

    def shuffled(self, a: Any, b: Any, places: list[int]) -> Any:
        """Return numbers picked from two vectors."""
        return self.builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), len(places)), places))

    def gain(self, held: Any, factor: Any, value: Any, subtract: bool) -> None:
        """Add a product to the held block, or subtract it."""
        product = self.builder.fmul(factor, value, flags=["contract"])
        operation = self.builder.fsub if subtract else self.builder.fadd
        self.builder.store(operation(self.builder.load(held), product, flags=["contract"]), held)

    def transposed(self, rows: list[Any]) -> list[Any]:
        """Return the columns of 8 x 8 numbers: pairs of rows exchange single numbers, then two, then four."""
        for width in (1, 2, 4):
            low = [i + (LANES - width if i & width else 0) for i in range(LANES)]
            high = [place + width for place in low]
            for i in (i for i in range(LANES) if not i & width):
                a, b = rows[i], rows[i + width]
                rows[i], rows[i + width] = self.shuffled(a, b, low), self.shuffled(a, b, high)
        return rows

    def columns_of(self, rows: list[Any]) -> list[Any]:
        """Return the 8 columns of 2, 4 or 8 rows."""
        if len(rows) == LANES:
            return self.transposed(rows)
        even = [i + k for k in range(0, LANES, 2) for i in (0, LANES)]
        odd = [place + 1 for place in even]
        pairs = [[self.shuffled(rows[i], rows[i + 1], half) for i in range(0, len(rows), 2)] for half in (even, odd)]
        columns = []
        for k in range(LANES):
            a, places = pairs[k % 2], [k - k % 2, k - k % 2 + 1]
            places += [LANES + place for place in places] * (len(a) - 1)
            columns.append(self.shuffled(a[0], a[-1], places))
        return columns


def _square(_typing: Any, P: Any, V: Any, count: Any, row: Any, column: Any) -> Any:
    """Subtract from the 8 x 8 block of P that begins at (row, column), and write its transpose to (column, row)."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        to, (count, row, column) = _Builder(context, builder, signature, values), values[2:]
        places = [to.place(0, to.plus(row, i), column) for i in range(LANES)]
        held = [cgutils.alloca_once_value(builder, builder.load(at, align=8)) for at in places]
        with cgutils.for_range(builder, count) as loop:
            value = builder.load(to.place(1, loop.index, column), align=8)
            for i in range(LANES):
                factor = to.everywhere(to.place(1, loop.index, to.plus(row, i), ir.DoubleType()))
                to.gain(held[i], factor, value, subtract=True)
        rows = [builder.load(at) for at in held]
        for value, at in zip(rows, places, strict=True):
            builder.store(value, at, align=8)
        with builder.if_then(builder.icmp_signed("!=", row, column)):
            for i, value in enumerate(to.transposed(rows)):
                builder.store(value, to.place(0, to.plus(column, i), row), align=8)
        return context.get_dummy_value()

    return types.void(P, V, types.intp, types.intp, types.intp), generate


def _rows(_typing: Any, W: Any, F: Any, A: Any, at: Any, count: Any, column: Any) -> Any:
    """Add F A to 8 columns of W, of A the rows `at`; or, where `at` is None, subtract F A."""
    picked = isinstance(at, types.Array)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        to, (count, column) = _Builder(context, builder, signature, values), values[4:]
        places = [to.place(0, ir.Constant(column.type, i), column) for i in range(ROWS)]
        held = [cgutils.alloca_once_value(builder, builder.load(place, align=8)) for place in places]
        with cgutils.for_range(builder, count) as loop:
            row = to.entry(3, loop.index) if picked else loop.index
            value = builder.load(to.place(2, row, column), align=8)
            for i in range(ROWS):
                factor = to.everywhere(to.place(1, ir.Constant(column.type, i), loop.index, ir.DoubleType()))
                to.gain(held[i], factor, value, subtract=not picked)
        for one, place in zip(held, places, strict=True):
            builder.store(builder.load(one), place, align=8)
        return context.get_dummy_value()

    return types.void(W, F, A, at, types.intp, types.intp), generate


def _sum(_typing: Any, P: Any, to: Any, sources: Any, factors: Any, column: Any) -> Any:
    """Add to 8 columns of one row of P multiples of others, one after the other, each product rounded."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        blocks, (to, sources, factors, column) = _Builder(context, builder, signature, values), values[1:]
        place = blocks.place(0, to, column)
        held = builder.load(place, align=8)
        for i in range(signature.args[2].count):
            value = builder.load(blocks.place(0, builder.extract_value(sources, i), column), align=8)
            held = builder.fadd(held, builder.fmul(blocks.filled(builder.extract_value(factors, i)), value))
        builder.store(held, place, align=8)
        return context.get_dummy_value()

    return types.void(P, types.intp, sources, factors, types.intp), generate


def _scaled(_typing: Any, P: Any, row: Any, factor: Any, column: Any) -> Any:
    """Multiply 8 columns of one row of P."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        blocks, (row, factor, column) = _Builder(context, builder, signature, values), values[1:]
        place = blocks.place(0, row, column)
        builder.store(builder.fmul(builder.load(place, align=8), blocks.filled(factor)), place, align=8)
        return context.get_dummy_value()

    return types.void(P, types.intp, types.float64, types.intp), generate


def _columns(rows: int) -> Callable[..., Any]:
    """Return a function that copies 8 entries of 2, 4 or 8 rows, from a column on, into the columns of their numbers.

    Written out, because otherwise the compiler emits single stores: the columns are neighbours, and take one store.
    """

    def copy(_typing: Any, P: Any, row: Any, column: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            to, (row, column) = _Builder(context, builder, signature, values), values[1:]
            loaded = [builder.load(to.place(0, to.plus(row, i), column), align=8) for i in range(rows)]
            kind = ir.VectorType(ir.DoubleType(), rows)
            for i, value in enumerate(to.columns_of(loaded)):
                builder.store(value, to.place(0, to.plus(column, i), row, kind), align=8)
            return context.get_dummy_value()

        return types.void(P, types.intp, types.intp), generate

    return cast(Callable[..., Any], intrinsic(copy))


_copy_two, _copy_four, _copy_eight = (_columns(rows) for rows in (2, 4, 8))
_subtract_square = cast(Callable[[Matrix, Matrix, int, int, int], None], intrinsic(_square))
_gain_rows = cast(Callable[[Matrix, Matrix, Matrix, IntVector | None, int, int], None], intrinsic(_rows))
_sum_rows = cast(Callable[[Matrix, int, tuple[int, ...], tuple[float, ...], int], None], intrinsic(_sum))
_scale_row = cast(Callable[[Matrix, int, float, int], None], intrinsic(_scaled))


@kernel()
def subtract_square(P: Matrix, V: Matrix, count: int) -> None:
    """Subtract V^T V from a symmetric P (n, n) for the first `count` rows of V: one half, copied to the other."""
    for row in range(0, P.shape[0], LANES):
        for column in range(row, P.shape[0], LANES):
            _subtract_square(P, V, count, row, column)


@kernel(inlined=True)
def add_rows(W: Matrix, F: Matrix, A: Matrix, at: IntVector, count: int) -> None:
    """Add to the four rows of W (4, n) the sum over k < count of F[:, k] A[at[k]]."""
    for column in range(0, W.shape[1], LANES):
        _gain_rows(W, F, A, at, count, column)


@kernel(inlined=True)
def subtract_rows(W: Matrix, F: Matrix, A: Matrix, count: int) -> None:
    """Subtract from the four rows of W (4, n) the sum over k < count of F[:, k] A[k]."""
    for column in range(0, W.shape[1], LANES):
        _gain_rows(W, F, A, None, count, column)


@kernel(inlined=True)
def add_to_row(P: Matrix, to: int, source: int, factor: float) -> None:
    """Add a multiple of one row of P to another."""
    for column in range(0, P.shape[1], LANES):
        _sum_rows(P, to, (source,), (factor,), column)


@kernel(inlined=True)
def add_two_to_row(P: Matrix, to: int, sources: tuple[int, int], factors: tuple[float, float]) -> None:
    """Add multiples of two rows of P to a third."""
    for column in range(0, P.shape[1], LANES):
        _sum_rows(P, to, sources, factors, column)


@kernel(inlined=True)
def scale_row(P: Matrix, row: int, factor: float) -> None:
    """Multiply one row of P."""
    for column in range(0, P.shape[1], LANES):
        _scale_row(P, row, factor, column)


@kernel()
def copy_to_columns(P: Matrix, row: int, rows: int, first: int, last: int) -> None:
    """Copy columns first to last - 1 of some rows of P (n, n) into the columns of the rows' numbers."""
    whole = last - LANES + 1
    while rows > 0:
        # As many as stand within one line of each row that is written.
        width = 8 if rows >= 8 and row % 8 == 0 else 4 if rows >= 4 and row % 4 == 0 else 1
        width = 2 if width == 1 and rows >= 2 and row % 2 == 0 else width
        if width == 8:
            for j in range(first, whole, LANES):
                _copy_eight(P, row, j)
        elif width == 4:
            for j in range(first, whole, LANES):
                _copy_four(P, row, j)
        elif width == 2:
            for j in range(first, whole, LANES):
                _copy_two(P, row, j)
        done = first if width == 1 else first + (last - first) // LANES * LANES
        for j in range(done, last):
            for i in range(row, row + width):
                P[j, i] = P[i, j]
        row, rows = row + width, rows - width


@kernel()
def copy_upper_blocks(source: Matrix, to: Matrix) -> None:
    """Copy the blocks of 8 x 8 numbers on the diagonal and above of one matrix into another of its shape."""
    n = np.uint64(source.shape[1])
    for i in range(source.shape[0]):
        for j in range(np.uint64(i & ~7), n):  # unsigned: signed indices are tested, and nothing is vectorised
            to[i, j] = source[i, j]


@kernel()
def reflect(P: Matrix) -> None:
    """Copy the blocks above the diagonal to below it."""
    for k in range(0, P.shape[0], LANES):
        copy_to_columns(P, k, LANES, k + LANES, P.shape[0])

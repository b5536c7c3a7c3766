"""Vectors of eight numbers, for parts of kernels whose loops are too short for the compiler to vectorise; compiled.

`in_lanes` makes such a part of a function that writes its instructions: it gets a `Table` for each array, `Lanes` for
each float, the same in all lanes, an index for each integer, and tuples with names of these. Products are added in one
rounding.
"""

import inspect
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple, cast

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

LANES = 8
_NUMBERS = ir.VectorType(ir.DoubleType(), LANES)
_WORDS = ir.VectorType(ir.IntType(64), LANES)
_FOUR = ir.VectorType(ir.DoubleType(), 4)
# Where a transposition of four by four finds its numbers, in both halves: single ones first, then pairs.
_EVEN, _ODD = (0, 8, 2, 10, 4, 12, 6, 14), (1, 9, 3, 11, 5, 13, 7, 15)
_LOW, _HIGH = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
_FLAGS = ("contract",)
_ROOT = 0x5FE6EB50C7B537A9  # minus half the bits of a number: its inverse square root to within 3.5 %
MAGIC = 6755399441055744.0  # 1.5 * 2^52: adding it leaves the nearest integer in the low bits of a float64
_EXPONENT_OF_ONE, _EXPONENT_AT = 1023, 52
# exp(r) for |r| <= ln(2) / 2, from the highest power down.
_SERIES = tuple(1.0 / f for f in (479001600, 39916800, 3628800, 362880, 40320, 5040, 720, 120, 24, 6, 2, 1, 1))


class Lanes(NamedTuple):
    """Eight numbers."""

    builder: Any
    value: Any

    def _with(self, other: "Lanes | float", operation: str) -> "Lanes":
        second = other.value if isinstance(other, Lanes) else ir.Constant(_NUMBERS, [float(other)] * LANES)
        return Lanes(self.builder, getattr(self.builder, operation)(self.value, second, flags=_FLAGS))

    def plus(self, other: "Lanes | float") -> "Lanes":
        """Return the sums."""
        return self._with(other, "fadd")

    def minus(self, other: "Lanes | float") -> "Lanes":
        """Return the differences."""
        return self._with(other, "fsub")

    def times(self, other: "Lanes | float") -> "Lanes":
        """Return the products."""
        return self._with(other, "fmul")

    def over(self, other: "Lanes | float") -> "Lanes":
        """Return the quotients."""
        return self._with(other, "fdiv")

    def subtracted_from(self, number: float) -> "Lanes":
        """Return a number less these."""
        return Lanes(self.builder, ir.Constant(_NUMBERS, [number] * LANES)).minus(self)

    def squared(self) -> "Lanes":
        """Return the squares."""
        return self.times(self)

    def _words(self) -> Any:
        return self.builder.bitcast(self.value, _WORDS)

    def within(self, least: float, most: float) -> "Lanes":
        """Return the numbers, held between two."""
        b, value = self.builder, self.value
        for bound, beyond in ((most, ">"), (least, "<")):
            limit = ir.Constant(_NUMBERS, [bound] * LANES)
            value = b.select(b.fcmp_ordered(beyond, value, limit), limit, value)
        return Lanes(b, value)

    def before(self, count: Any, others: "Lanes") -> "Lanes":
        """Return the numbers of the lanes before `count`, and others in those from there on."""
        b = self.builder
        inside = b.icmp_signed("<", ir.Constant(_WORDS, list(range(LANES))), _everywhere(b, count, _WORDS))
        return Lanes(b, b.select(inside, self.value, others.value))

    def first(self, count: Any) -> "Lanes":
        """Return the numbers with zero in all lanes from `count` on."""
        return self.before(count, nothing(self.builder))

    def inverse_root(self) -> "Lanes":
        """Return 1 / sqrt for positive normal numbers, to 2 ulp.

        Newton's steps take less than half the time of a root and a division.
        """
        b = self.builder
        guess = b.sub(ir.Constant(_WORDS, [_ROOT] * LANES), b.lshr(self._words(), ir.Constant(_WORDS, [1] * LANES)))
        half, root = self.times(0.5), Lanes(b, b.bitcast(guess, _NUMBERS))
        for _ in range(3):
            root = root.times(half.times(root).times(root).subtracted_from(1.5))
        return root.plus(root.times(half.times(root).times(root).subtracted_from(0.5)))

    def inverse(self) -> "Lanes":
        """Return 1 / x."""
        return Lanes(self.builder, ir.Constant(_NUMBERS, [1.0] * LANES)).over(self)

    def exponential(self) -> "Lanes":
        """Return exp for numbers within 700 of zero, to 2 ulp."""
        b = self.builder
        shifted = self.times(1.4426950408889634).plus(MAGIC)
        whole = shifted.minus(MAGIC)
        r = self.minus(whole.times(0.693147180369123816490)).minus(whole.times(1.90821492927058770002e-10))
        sum_ = r.times(_SERIES[0]).plus(_SERIES[1])
        for factor in _SERIES[2:]:
            sum_ = sum_.times(r).plus(factor)
        bits = b.add(shifted._words(), ir.Constant(_WORDS, [_EXPONENT_OF_ONE] * LANES))
        power = b.shl(bits, ir.Constant(_WORDS, [_EXPONENT_AT] * LANES))
        return sum_.times(Lanes(b, b.bitcast(power, _NUMBERS)))

    def sum(self) -> Any:
        """Return the sum of the eight."""
        b = self.builder
        kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType(), _NUMBERS])
        name = f"llvm.vector.reduce.fadd.v{LANES}f64"
        function = b.module.globals.get(name) or ir.Function(b.module, kind, name)
        return b.call(function, [ir.Constant(ir.DoubleType(), 0.0), self.value], fastmath=("reassoc", "nsz"))


class Table(NamedTuple):
    """An array of numbers; indices end with a column, from which on eight are read or written."""

    builder: Any
    array: Any

    def place(self, *index: Any) -> Any:
        """Return the address of a number."""
        b, at = self.builder, index[0]
        for axis, further in enumerate(index[1:], 1):
            at = b.add(b.mul(at, self.shape(axis)), further)
        return b.gep(self.array.data, [at])

    def read(self, *index: Any) -> Lanes:
        """Return eight neighbours."""
        b = self.builder
        return Lanes(b, b.load(b.bitcast(self.place(*index), _NUMBERS.as_pointer()), align=8))

    def one(self, *index: Any) -> Lanes:
        """Return one number in all lanes."""
        return Lanes(self.builder, _everywhere(self.builder, self.builder.load(self.place(*index)), _NUMBERS))

    def write(self, value: Lanes, *index: Any) -> None:
        """Write eight neighbours."""
        b = self.builder
        b.store(value.value, b.bitcast(self.place(*index), _NUMBERS.as_pointer()), align=8)

    def read_four(self, *index: Any) -> Any:
        """Return four neighbours."""
        b = self.builder
        return b.load(b.bitcast(self.place(*index), _FOUR.as_pointer()), align=8)

    def write_four(self, value: Any, *index: Any) -> None:
        """Write four neighbours."""
        b = self.builder
        b.store(value, b.bitcast(self.place(*index), _FOUR.as_pointer()), align=8)

    def shape(self, axis: int) -> Any:
        """Return the length of an axis."""
        return self.builder.extract_value(self.array.shape, axis)

    def put(self, number: Any, *index: Any) -> None:
        """Write one number."""
        self.builder.store(number, self.place(*index))

    def add_one(self, more: Any, *index: Any) -> None:
        """Add to one number."""
        b, place = self.builder, self.place(*index)
        b.store(b.fadd(b.load(place), more), place)


def _everywhere(builder: Any, number: Any, kind: Any) -> Any:
    nothing = ir.Constant(kind, ir.Undefined)
    one = builder.insert_element(nothing, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, nothing, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


def _picked(builder: Any, a: Any, b: Any, places: Sequence[int]) -> Any:
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), len(places)), list(places)))


def index(number: int) -> Any:
    """Return an index that is known beforehand."""
    return ir.Constant(ir.IntType(64), number)


def columns_of_fours(builder: Any, rows: list[Any]) -> list[Lanes]:
    """Return the four columns of eight rows of four."""
    halves = [_picked(builder, rows[i], rows[i + 4], range(8)) for i in range(4)]
    pairs = [_picked(builder, halves[i], halves[i + 1], at) for i in (0, 2) for at in (_EVEN, _ODD)]
    return [
        Lanes(builder, _picked(builder, pairs[p % 2], pairs[2 + p % 2], _HIGH if p > 1 else _LOW)) for p in range(4)
    ]


def fours_of_columns(builder: Any, columns: list[Lanes]) -> list[Any]:
    """Return the eight rows of four columns."""
    pairs = [_picked(builder, columns[i].value, columns[i + 1].value, at) for i in (0, 2) for at in (_EVEN, _ODD)]
    halves = [_picked(builder, pairs[p % 2], pairs[2 + p % 2], _HIGH if p > 1 else _LOW) for p in range(4)]
    return [_picked(builder, halves[i % 4], halves[i % 4], range(i & 4, (i & 4) + 4)) for i in range(LANES)]


def nothing(builder: Any) -> Lanes:
    """Return eight zeros."""
    return Lanes(builder, ir.Constant(_NUMBERS, [0.0] * LANES))


def eights(builder: Any, first: Any, end: Any) -> Any:
    """Return how many vectors hold the entries from `first` to before `end`."""
    return builder.lshr(builder.add(builder.sub(end, first), index(LANES - 1)), index(3))


def repeated(
    builder: Any, count: Any, start: list[Lanes], body: Callable[[Any, list[Lanes]], list[Lanes]]
) -> list[Lanes]:
    """Write a loop that carries vectors along; body(index, vectors) returns the next ones."""
    held = [cgutils.alloca_once_value(builder, lanes.value) for lanes in start]
    with cgutils.for_range(builder, count) as loop:
        following = body(loop.index, [Lanes(builder, builder.load(one)) for one in held])
        for one, value in zip(held, following, strict=True):
            builder.store(value.value, one)
    return [Lanes(builder, builder.load(one)) for one in held]


def _argument(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.Array):
        return Table(builder, context.make_array(kind)(context, builder, value))
    if isinstance(kind, types.BaseNamedTuple):
        fields = cast(Any, kind)
        parts = [builder.extract_value(value, i) for i in range(len(fields.types))]
        return fields.instance_class(*map(partial(_argument, context, builder), fields.types, parts))
    return Lanes(builder, _everywhere(builder, value, _NUMBERS)) if isinstance(kind, types.Float) else value


def in_lanes(write: Callable[..., None]) -> Callable[..., None]:
    """Return a function for use inside kernels, whose instructions `write(builder, *arguments)` writes."""

    def typed(_typing: Any, *given: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            arguments = map(partial(_argument, context, builder), signature.args, values)
            write(builder, *arguments)
            return context.get_dummy_value()

        return types.void(*given), generate

    cast(Any, typed).__signature__ = inspect.signature(write)
    return cast(Callable[..., None], intrinsic(typed))

"""Declares compiled functions: typed by their annotations, cached, without the GIL.

`@kernel` derives the compiled signature from the annotations, so that it is written once and checked by mypy:

    float, int, bool        float64, int64, boolean
    Vector, Matrix, ...     contiguous arrays (groundstation.arrays)
    a NamedTuple            several arguments under documented names, handed over by reference
    a Record                one row of a table with named fields; Rows[Record] is the table, RowsStack[Record] several
    tuple[...]              several results

An explicit signature compiles when the module is imported, so nothing can compile later in flight. Models are called
through tables of addresses: the loops that call them are compiled once and need no edit when a model is added.
"""

import inspect
import struct
from collections.abc import Callable, Iterator
from typing import Any, ClassVar, Generic, Self, TypeVar, cast, get_args, get_origin, get_type_hints, overload

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, lower_cast
from numpy.typing import NDArray

Function = TypeVar("Function", bound=Callable[..., Any])
Row = TypeVar("Row", bound="Record", covariant=True)

_SCALARS: dict[Any, Any] = {float: types.float64, int: types.int64, bool: types.boolean, type(None): types.void}


class Record:
    """One row of a table: fields are float, int, Records, or arrays `Annotated[Array, (rows, columns)]`, 8 bytes each.

    A subclass only lists its fields. In Python a row is a numpy record (`row["field"]`); in kernels it is `row.field`.
    Rows are references: the table that a row was taken from has to be used after the row's last use in a kernel.
    """

    dtype: ClassVar[np.dtype[Any]]

    def __init_subclass__(cls) -> None:
        """Derive the layout from the annotations, in their order; those of bases come first."""
        super().__init_subclass__()
        hints = get_type_hints(cls, include_extras=True)
        hints.pop("dtype")
        cls.dtype = np.dtype([_field(name, hint) for name, hint in hints.items()], align=True)

    @overload
    @classmethod
    def rows(cls, count: int, /) -> "Rows[Self]": ...
    @overload
    @classmethod
    def rows(cls, stacked: int, count: int, /) -> "RowsStack[Self]": ...
    @classmethod
    def rows(cls, *shape: int) -> Any:
        """Return a table of zeros with the given shape, or a stack of tables."""
        return np.zeros(shape, dtype=cls.dtype)

    @classmethod
    def row(cls, **fields: Any) -> Self:
        """Return one row with the given fields; the others are zero. Raises ValueError for an unknown field."""
        row = cls.rows(1)[0]
        for name, value in fields.items():
            row[name] = value
        return row

    @classmethod
    def packing(cls) -> struct.Struct:
        """Return the packing of a row: its numbers in order, those of arrays row by row."""
        return struct.Struct("".join(_codes(cls.dtype)))

    def __getitem__(self, field: str) -> Any:
        """Return a field by its name, outside of kernels."""
        raise NotImplementedError

    def __setitem__(self, field: str, value: Any) -> None:
        """Write a field by its name, outside of kernels."""
        raise NotImplementedError


def _as_array(_context: Any, _builder: Any, _own: Any, _array: Any, field: Any) -> Any:
    """Pass an array within a row like any other array."""
    return field


lower_cast(types.NestedArray, types.Array)(_as_array)


def _element(array: Any) -> Any:
    """Return the number type of an `NDArray`, which from numpy 2.5 on is an alias with this one argument."""
    arguments = get_args(array)
    return arguments[0] if len(arguments) == 1 else get_args(arguments[1])[0]


def _field(name: str, hint: Any) -> tuple[str, Any] | tuple[str, Any, tuple[int, ...]]:
    if hint in (float, int):
        return name, np.float64 if hint is float else np.int64
    if isinstance(hint, type) and issubclass(hint, Record):
        return name, hint.dtype
    array, shape = get_args(hint)
    return name, _element(array), shape


class Rows(Generic[Row]):
    """A table of records as the type checker sees it; at run time it is a structured array of one axis."""

    shape: tuple[int, ...]

    @overload
    def __getitem__(self, index: int) -> Row: ...
    @overload
    def __getitem__(self, index: str) -> NDArray[Any]: ...
    def __getitem__(self, index: int | str) -> Row | NDArray[Any]:
        """Return one row, by reference; of a field's name, its column."""
        raise NotImplementedError

    def __setitem__(self, field: str, values: Any) -> None:
        """Write a column."""
        raise NotImplementedError

    def __len__(self) -> int:
        """Return the number of rows."""
        raise NotImplementedError

    def __iter__(self) -> Iterator[Row]:
        """Return one row after the other."""
        raise NotImplementedError


class RowsStack(Generic[Row]):
    """Several tables of equal length as the type checker sees them; at run time a structured array of two axes."""

    shape: tuple[int, ...]

    @overload
    def __getitem__(self, index: int) -> Rows[Row]: ...
    @overload
    def __getitem__(self, index: tuple[int, int]) -> Row: ...
    @overload
    def __getitem__(self, index: str) -> NDArray[Any]: ...
    def __getitem__(self, index: int | tuple[int, int] | str) -> Rows[Row] | Row | NDArray[Any]:
        """Return one table or one row, by reference; of a field's name, its values in all tables."""
        raise NotImplementedError

    def __len__(self) -> int:
        """Return the number of tables."""
        raise NotImplementedError


def _codes(dtype: np.dtype[Any]) -> Iterator[str]:
    """Return the code of each number of a row, as the struct module writes it."""
    for name in dtype.names or ():
        field = dtype[name]
        if field.names is not None:
            yield from _codes(field)
        else:
            yield ("q" if field.base.kind == "i" else "d") * (field.itemsize // field.base.itemsize)


def compiled_type(hint: Any) -> Any:
    """Return the numba type of an annotation; raises TypeError for one that kernels cannot take."""
    if hint in _SCALARS:
        return _SCALARS[hint]
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Rows, RowsStack):
        return types.Array(numba.from_dtype(arguments[0].dtype), 1 if origin is Rows else 2, "C")
    if origin is tuple:
        return types.BaseTuple.from_types([compiled_type(argument) for argument in arguments])
    if hasattr(hint, "__metadata__"):
        return types.Array(numba.from_dtype(np.dtype(_element(arguments[0]))), hint.__metadata__[0], "C")
    if isinstance(hint, type) and issubclass(hint, Record):
        return numba.from_dtype(hint.dtype)
    if isinstance(hint, type) and hasattr(hint, "_fields"):
        fields = get_type_hints(hint, include_extras=True)
        return types.BaseTuple.from_types([compiled_type(fields[name]) for name in hint._fields], hint)
    raise TypeError(f"kernels take no {hint!r}")


def signature_of(function: Callable[..., Any]) -> Any:
    """Return the compiled signature that a function's annotations stand for; raises TypeError where one is missing."""
    hints = get_type_hints(function, include_extras=True)
    missing = [name for name in (*inspect.signature(function).parameters, "return") if name not in hints]
    if missing:
        raise TypeError(f"{function.__qualname__}: no annotation for {', '.join(missing)}")
    arguments = [compiled_type(hints[name]) for name in inspect.signature(function).parameters]
    return compiled_type(hints["return"])(*arguments)


def kernel(
    *, inlined: bool = False, contract: bool = False, reassociate: bool = False
) -> Callable[[Function], Function]:
    """Compile a function for the signature of its annotations, with IEEE arithmetic, so that replays agree to the bit.

    inlined: into every kernel that calls it, for functions that are short or called from one place. Passing 12 arrays
    takes as long as a small kernel's work; but frequent copies make compiling slow.
    contract: multiply and add in one rounding, where that is worth more than agreeing with numpy.
    reassociate: sum in another order, so that sums are vectorised.

    Cached only in a directory that the process has chosen by the state of all sources (process/numba_cache.py): beside
    the source, numba would not notice an edited callee or constant of another module.
    """

    def compile_(function: Function) -> Function:
        cached = bool(getattr(numba.config, "CACHE_DIR", ""))
        compiled = numba.njit(
            signature_of(function), cache=cached, nogil=True, error_model="numpy", forceinline=inlined,
            fastmath={name for name, wanted in (("contract", contract), ("reassoc", reassociate)) if wanted} or False,
        )  # fmt: skip
        return cast(Function, compiled(function))

    return compile_


def address_of(compiled: Callable[..., Any], declaration: Callable[..., Any] | None = None) -> int:
    """Return the address of a kernel's machine code, a C function; valid in this process only.

    declaration: its signature must be the kernel's, as for `caller`; else raises TypeError.
    """
    (result,) = cast(Any, compiled).overloads.values()
    if declaration is not None and result.signature != signature_of(declaration):
        raise TypeError(f"{compiled.__qualname__} takes {result.signature}, not {signature_of(declaration)}")
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name))


def caller(declaration: Function) -> Callable[[int, tuple[Any, ...]], Any]:
    """Return a function for use inside kernels: called with an address and arguments, it calls the kernel there.

    declaration: a function without a body whose annotations are the signature. The address is data, not part of the
    compiled code, so that callers can be cached.
    """
    signature = signature_of(declaration)
    arguments, result = signature.args, signature.return_type

    @intrinsic
    def call_at(typing: Any, address: Any, given: Any) -> Any:
        if len(given) != len(arguments) or not all(map(typing.can_convert, given, arguments)):
            return None

        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            unpacked = [
                context.cast(builder, builder.extract_value(values[1], i), own, wanted)
                for i, (own, wanted) in enumerate(zip(given, arguments, strict=True))
            ]
            shape = ir.FunctionType(context.get_value_type(result), [context.get_value_type(a) for a in arguments])
            value = builder.call(builder.inttoptr(values[0], shape.as_pointer()), unpacked)
            return context.get_dummy_value() if result == types.void else value

        return result(types.int64, given), generate

    return cast(Callable[[int, tuple[Any, ...]], Any], call_at)


def viewed_as(record: type[Row], field: str) -> Callable[[Record], Row]:
    """Return a function for use inside kernels: a field of a row, an array of words, as another record, by reference.

    For parts in which the rows of one table differ.
    """
    result = numba.from_dtype(record.dtype)

    @intrinsic
    def view(_typing: Any, row: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            place = cgutils.pointer_add(builder, values[0], row.offset(field))
            return builder.bitcast(place, context.get_value_type(result))

        return result(row), generate

    return cast(Callable[[Record], Row], view)


def _copy_rows(_typing: Any, source: Any, to: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        given, copy = (
            context.make_array(kind)(context, builder, value)
            for kind, value in zip(signature.args, values, strict=True)
        )
        cgutils.raw_memcpy(builder, copy.data, given.data, given.nitems, given.itemsize)
        return context.get_dummy_value()

    return types.void(source, to), generate


copy_rows = cast(Callable[[Any, Any], None], intrinsic(_copy_rows))
"""For use inside kernels: copies one table into another of its shape."""

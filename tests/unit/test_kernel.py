"""Kernels are compiled for their annotated signature, and called by address with records and tuples."""

from collections.abc import Callable
from types import GenericAlias
from typing import Annotated, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
import pytest

from groundstation.arrays import Array, IntArray, IntMatrix, Matrix, Vector
from groundstation.kernel import (
    Record,
    Rows,
    RowsStack,
    address_of,
    caller,
    compiled_type,
    copy_rows,
    kernel,
    signature_of,
    viewed_as,
)


class Reading(Record):
    """A row."""

    at: float
    kind: int
    z: Annotated[Array, (2,)]
    R: Annotated[Array, (2, 2)]


class Filter(NamedTuple):
    """Several arrays."""

    mean: Vector
    P: Matrix


def _declared(belief: Filter, reading: Reading) -> float: ...  # type: ignore[empty-body]


call = caller(_declared)


@kernel()
def weigh(belief: Filter, reading: Reading) -> float:
    """Write into both, and return what was read."""
    total = 0.0
    for i in range(2):
        belief.mean[i] += reading.z[i]
        for j in range(2):
            total += reading.R[i, j] * belief.P[i, j]
    reading.at = total
    return total + reading.kind


@kernel()
def weigh_all(address: int, belief: Filter, readings: Rows[Reading]) -> tuple[float, int]:
    """Call a kernel by its address for each row."""
    total = 0.0
    for row in range(readings.shape[0]):
        total += call(address, (belief, readings[row]))
    return total, readings.shape[0]


def test_a_kernel_reads_and_writes_records_and_tuples_through_an_address():
    belief, readings = Filter(np.zeros(3), np.eye(3)), Reading.rows(2)
    readings["kind"], readings["z"], readings["R"] = (1, 2), [[1.0, 2.0]] * 2, [np.eye(2) * 3.0] * 2
    assert weigh_all(address_of(weigh), belief, readings) == (6.0 + 1 + 6.0 + 2, 2)
    assert list(belief.mean) == [2.0, 4.0, 0.0] and list(readings["at"]) == [6.0, 6.0]


@runtime_checkable
class Compiled(Protocol):
    """numba's compilation result of a function."""

    py_func: Callable[..., Any]


def test_the_signature_is_the_annotations():
    compiled: object = weigh_all
    assert isinstance(compiled, Compiled)
    text = str(signature_of(compiled.py_func))
    assert text.startswith("(int64, Filter(") and text.endswith("-> Tuple(float64, int64)")
    assert Reading.dtype.names == ("at", "kind", "z", "R") and Reading.dtype.itemsize == 8 * (2 + 2 + 4)


def test_arrays_are_compiled_whatever_numpy_takes_its_alias_for():
    alias = GenericAlias(np.ndarray, (np.int64,))  # numpy 2.5's, which is given the type of the numbers alone
    assert compiled_type(Annotated[alias, 2]) == compiled_type(IntMatrix) != compiled_type(Matrix)


def test_annotations_that_cannot_be_compiled_are_refused_by_name():
    def lacking(x: float, y) -> float:
        return x

    def textual(x: str) -> float:
        return 0.0

    with pytest.raises(TypeError, match="lacking: no annotation for y"):
        signature_of(lacking)
    with pytest.raises(TypeError, match="str"):
        signature_of(textual)


def test_a_kernel_takes_no_array_of_another_layout():
    with pytest.raises(TypeError, match="No matching definition"):
        weigh(Filter(np.zeros(3), np.eye(3).T[::2]), Reading.rows(1)[0])


class Own(Record):
    """Fields of one kind of Device."""

    gain: float
    number: int


class Device(Record):
    """A row that contains another row, and array words for the fields of its own kind."""

    size: int
    reading: Reading
    own: Annotated[IntArray, (3,)]


own = viewed_as(Own, "own")
_DEVICE = Device.dtype


@kernel()
def trace(R: Matrix) -> float:
    """Sum the diagonal of an array that may be a row's field."""
    return float(R[0, 0] + R[1, 1])


@kernel()
def amplify(devices: RowsStack[Device], copied: Rows[Device]) -> float:
    """Write through all kinds of access to rows; return the contents of a table made in here."""
    made = np.zeros(devices.shape[1], _DEVICE)
    for i in range(devices.shape[1]):
        device = devices[1, i]
        device.reading.kind += 1
        own(device).gain *= 2.0
        own(made[i]).gain = trace(device.reading.R)
    copy_rows(devices[1], copied)
    return own(made[0]).gain + own(made[1]).gain


def test_rows_hold_rows_and_what_is_their_own():
    devices, copied = Device.rows(2, 2), Device.rows(2)
    own_words = np.frombuffer(np.asarray(Own.row(gain=1.5, number=7)).tobytes(), np.int64)
    devices["own"][:, :, :2] = own_words
    devices["reading"]["R"] = np.eye(2)
    assert amplify(devices, copied) == 4.0
    assert devices["reading"]["kind"].tolist() == [[0, 0], [1, 1]]
    assert np.array_equal(np.asarray(copied), np.asarray(devices[1]))
    assert np.frombuffer(copied["own"][0, :2].tobytes(), Own.dtype)[0].tolist() == (3.0, 7)


def test_a_row_is_made_by_its_fields_and_packed_in_their_order():
    assert np.asarray(Own.row(number=3)).tolist() == (0.0, 3)
    with pytest.raises(ValueError, match="no field"):
        Own.row(colour=1.0)
    packing = Device.packing()
    assert packing.format == "q" + "dq" + "dd" + "dddd" + "qqq" and packing.size == Device.dtype.itemsize


def test_the_address_of_a_kernel_is_that_of_its_declaration():
    assert address_of(weigh, _declared) == address_of(weigh)
    with pytest.raises(TypeError, match="weigh_all takes"):
        address_of(weigh_all, _declared)

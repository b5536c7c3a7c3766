"""Messages as rows of tables: one table for each topic, and one more for each list inside its messages.

Columns are named as the fields, vectors by axis, the unit last (`velocity_x_m_s`). Lists of numbers without names
stay lists.
"""

import math
import types
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache
from typing import Any, Union, get_args, get_origin, get_type_hints

import msgspec

from groundstation.bus import messages as m
from groundstation.bus.topics import ESTIMATE, Topic

Row = list[Any]
Getter = Callable[[Any], Any]

# Suffix of a name -> unit, longest first.
_UNITS = {
    "_rad_s": "rad/s",
    "_deg_s": "deg/s",
    "_m2_s2": "m^2/s^2",
    "_m_s2": "m/s^2",
    "_m_s": "m/s",
    "_m2": "m^2",
    "_rad2": "rad^2",
    "_m_rad": "m rad",
    "_rad": "rad",
    "_deg": "deg",
    "_hz": "Hz",
    "_bytes": "B",
    "_ppm": "ppm",
    "_px": "px",
    "_ms": "ms",
    "_ns": "ns",
    "_m": "m",
    "_s": "s",
}
_UNITS_OF = {"cost": "m^2", "information": "1/m^2", "battery": "1", "link_quality": "1", "nis": "1", "cpu": "cores"} | {
    "fps": "Hz",
    "solver_seconds": "s",
}
_XYZ = "xyz"


class Cell(Enum):
    """The type of a column's values."""

    REAL = "real"
    WHOLE = "whole"
    FLAG = "flag"
    TEXT = "text"
    REALS = "reals"


@dataclass(frozen=True, slots=True)
class Column:
    """Name, unit (empty: none) and type of a column."""

    name: str
    unit: str
    cell: Cell


@dataclass(frozen=True, slots=True)
class Table:
    """A table of one topic: `rows` turns a message into its rows, without the common first columns."""

    name: str
    columns: tuple[Column, ...]
    rows: Callable[[Any], list[Row]]


def column(name: str, cell: Cell) -> Column:
    """Return a column with the unit that its name says."""
    unit = next((unit for suffix, unit in _UNITS.items() if name.endswith(suffix)), _UNITS_OF.get(name, ""))
    return Column(name, unit, cell)


# Every table begins with these: seconds since the start of the run, UNIX time, entity, source.
COMMON = (
    column("time_s", Cell.REAL),
    column("unix_ns", Cell.WHOLE),
    column("entity", Cell.TEXT),
    column("source", Cell.TEXT),
    column("seq", Cell.WHOLE),
)


@cache
def tables_of(topic: Topic) -> tuple[Table, ...]:
    """Return the tables of a typed topic; the first is that of the messages themselves."""
    assert topic.type is not None
    name = f"{topic.plane.removeprefix('@')}_{topic.name}" if topic.plane else topic.name
    if topic is ESTIMATE:
        searches = _inner_table(f"{name}_searches", m.TargetSearch, _field("searches"))
        return (Table(name, _ESTIMATE_COLUMNS, _estimate_rows), searches)
    main: list[tuple[Column, Getter]] = []
    inner: list[Table] = []
    for field, kind in get_type_hints(topic.type).items():
        if field == "header":
            continue
        element = _element(kind)
        if element is None:
            main += _columns(field, kind, _field(field))
        else:
            inner.append(_inner_table(f"{name}_{field}", element, _field(field)))
    own = Table(name, tuple(column for column, _ in main), lambda message: [[get(message) for _, get in main]])
    return (own, *inner)


def _inner_table(name: str, element: type, items: Getter) -> Table:
    columns = [pair for field, kind in get_type_hints(element).items() for pair in _columns(field, kind, _field(field))]

    def rows(message: Any) -> list[Row]:
        return [[get(item) for _, get in columns] for item in items(message)]

    return Table(name, tuple(column for column, _ in columns), rows)


def _element(kind: Any) -> type | None:
    """Return the struct type in a field's list, or None."""
    arguments = get_args(kind)
    if get_origin(kind) is tuple and len(arguments) == 2 and arguments[1] is Ellipsis and _is_struct(arguments[0]):
        found: type = arguments[0]
        return found
    return None


def _is_struct(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)


def _field(name: str) -> Getter:
    return lambda value: None if value is None else getattr(value, name)


def _columns(name: str, kind: Any, get: Getter) -> Iterator[tuple[Column, Getter]]:
    if get_origin(kind) in (Union, types.UnionType):
        (kind,) = (one for one in get_args(kind) if one is not type(None))
    if _is_struct(kind):
        for field, inner in get_type_hints(kind).items():
            yield from _columns(f"{name}_{field}", inner, _chain(get, _field(field)))
        return
    arguments = get_args(kind)
    if get_origin(kind) is tuple and set(arguments) == {float}:
        for number, axis in enumerate(_axes_of(name, len(arguments))):
            yield column(_with_axis(name, axis), Cell.REAL), _chain(get, _item(number))
    elif get_origin(kind) is tuple and arguments == (float, Ellipsis):
        yield column(name, Cell.REALS), _chain(get, list)
    else:
        cell = {float: Cell.REAL, int: Cell.WHOLE, bool: Cell.FLAG}.get(kind, Cell.TEXT)
        is_text = isinstance(kind, type) and issubclass(kind, str)
        yield column(name, cell), get if cell is not Cell.TEXT or is_text else _chain(get, _json)


def _axes_of(name: str, size: int) -> Sequence[str]:
    if size == 4:
        return "wxyz"
    return ("roll", "pitch", "yaw") if name.startswith("attitude") else _XYZ[:size]


def _chain(get: Getter, then: Getter) -> Getter:
    def chained(value: Any) -> Any:
        found = get(value)
        return None if found is None else then(found)

    return chained


def _item(number: int) -> Getter:
    return lambda value: value[number]


def _json(value: Any) -> str:
    return msgspec.json.encode(value).decode()


def _with_axis(name: str, axis: str) -> str:
    suffix = next((suffix for suffix in _UNITS if name.endswith(suffix)), "")
    return f"{name.removesuffix(suffix)}_{axis}{suffix}"


_MEAN = ("x_m", "y_m", "z_m", "yaw_rad")
_AXES = ("x", "y", "z", "yaw")


def _covariance_name(row: int, col: int) -> str:
    unit = ("m2", "m_rad", "rad2")[(row == 3) + (col == 3)]
    return f"covariance_{_AXES[row]}_{_AXES[col]}_{unit}"


_UPPER = tuple((row, col) for row in range(4) for col in range(row, 4))
_UPPER_OF_VELOCITY = tuple((row, col) for row in range(3) for col in range(row, 3))
_ESTIMATE_COLUMNS = (
    column("name", Cell.TEXT),
    column("kind", Cell.TEXT),
    *(column(name, Cell.REAL) for name in _MEAN),
    *(column(f"velocity_{axis}_m_s", Cell.REAL) for axis in _XYZ),
    *(column(_covariance_name(row, col), Cell.REAL) for row, col in _UPPER),
    column("converged", Cell.FLAG),
    column("age_s", Cell.REAL),
    column("epoch", Cell.WHOLE),
    column("unlocalised_s", Cell.REAL),
    column("contradicted", Cell.FLAG),
    column("sighting_age_s", Cell.REAL),
    column("sighting_std_m", Cell.REAL),
    *(column(f"velocity_covariance_{_XYZ[row]}_{_XYZ[col]}_m2_s2", Cell.REAL) for row, col in _UPPER_OF_VELOCITY),
)


def _estimate_rows(message: m.Estimate) -> list[Row]:
    """Return a row for each entity: mean and upper triangle of the covariance by name; a target has no z and yaw."""
    rows = []
    for entity in message.entities:
        size = len(entity.mean)
        mean = [*entity.mean[:4], *([None] * (4 - size))]
        velocity = [*entity.velocity_m_s[:3], *([None] * (3 - len(entity.velocity_m_s)))]
        upper = [entity.covariance[row * size + col] if row < size and col < size else None for row, col in _UPPER]
        trust = [entity.unlocalised_s, entity.contradicted, *(entity.sighting or (None, None))]
        facts = [entity.converged, entity.age_s, message.epoch, *trust]
        rows.append([entity.name, entity.kind, *mean, *velocity, *upper, *facts, *_velocity_cells(entity)])
    return rows


def _velocity_cells(entity: m.EntityEstimate) -> Row:
    """Return the upper triangle of the covariance of its velocity, of a robot along its own axes."""
    told = entity.velocity_covariance or ()
    size = math.isqrt(len(told))
    return [told[row * size + col] if col < size else None for row, col in _UPPER_OF_VELOCITY]

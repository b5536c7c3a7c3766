"""Messages as rows: every topic, lists of any length, and vectors in the plane."""

import types
from enum import Enum
from typing import Any, Union, get_args, get_origin, get_type_hints

import msgspec
import pytest

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.topics import TOPICS, Topic
from groundstation.recording.tables import Table, tables_of

HEADER = m.Header(1, "clock", "turtlebot", "tracker", 1)


def _example(kind: Any) -> Any:
    """Return a value of a type, with one element in each list; structs as plain objects, which no rule refuses."""
    if get_origin(kind) in (Union, types.UnionType):
        return _example(next(one for one in get_args(kind) if one is not type(None)))
    if get_origin(kind) is tuple:
        return tuple(_example(one) for one in get_args(kind) if one is not Ellipsis)
    if get_origin(kind) is dict:
        return {}
    if issubclass(kind, Enum):
        return next(iter(kind))
    if issubclass(kind, msgspec.Struct):
        return types.SimpleNamespace(**{name: _example(one) for name, one in get_type_hints(kind).items()})
    return kind(1)


def _row(table: Table, message: Any) -> dict[str, Any]:
    (row,) = table.rows(message)
    return {column.name: cell for column, cell in zip(table.columns, row, strict=True)}


@pytest.mark.parametrize("topic", [topic for topic in TOPICS.values() if topic.type is not None], ids=lambda t: t.name)
def test_every_typed_topic_has_a_cell_for_each_column(topic: Topic) -> None:
    for table in tables_of(topic):
        _row(table, _example(topic.type))


def test_a_vector_in_the_plane_has_no_z() -> None:
    (table,) = tables_of(t.SEARCH_MAP)
    row = _row(table, m.SearchMap(header=HEADER, first_m=(-1.0, 2.0), cell_m=0.5, columns=2, chances=(255, 0)))
    assert (row["first_x_m"], row["first_y_m"]) == (-1.0, 2.0) and "first_z_m" not in row


def test_searches_of_an_estimate_have_a_table() -> None:
    search = m.TargetSearch("turtlebot", "SEARCH", 3.0, (1.0, 2.0), 0.25, None, "searched for")
    _, searches = tables_of(t.ESTIMATE)
    row = _row(searches, m.Estimate(header=HEADER, entities=(), epoch=1, searches=(search,)))
    assert searches.name == "estimate_searches"
    assert (row["target"], row["place_x_m"], row["expected_s"]) == ("turtlebot", 1.0, None)


def test_a_table_of_estimates_tells_how_far_they_can_be_trusted() -> None:
    estimates, _ = tables_of(t.ESTIMATE)
    place = ("turtlebot", "target", (1.0, 2.0), (0.01, 0.0, 0.0, 0.01), (0.0, 0.0), True, 0.1)
    for sighting, cells in (((0.4, 0.02), (0.4, 0.02)), (None, (None, None))):
        entity = m.EntityEstimate(*place, unlocalised_s=4.0, contradicted=True, sighting=sighting)
        row = _row(estimates, m.Estimate(header=HEADER, entities=(entity,), epoch=1))
        assert (row["unlocalised_s"], row["contradicted"]) == (4.0, True)
        assert (row["sighting_age_s"], row["sighting_std_m"]) == cells


def test_a_table_of_estimates_has_the_covariance_of_velocities() -> None:
    estimates, _ = tables_of(t.ESTIMATE)
    place = ("one", "target", (1.0, 2.0), (0.01, 0.0, 0.0, 0.01), (0.0, 0.0), True, 0.1)
    names = [f"velocity_covariance_{axes}_m2_s2" for axes in ("x_x", "x_y", "x_z", "y_y", "y_z", "z_z")]
    for told, cells in (
        (tuple(map(float, (1, 2, 3, 2, 5, 6, 3, 6, 9))), [1.0, 2.0, 3.0, 5.0, 6.0, 9.0]),
        ((1.0, 2.0, 2.0, 4.0), [1.0, 2.0, None, 4.0, None, None]),
        (None, [None] * 6),
    ):
        entity = m.EntityEstimate(*place, velocity_covariance=told)
        row = _row(estimates, m.Estimate(header=HEADER, entities=(entity,), epoch=1))
        assert [row[name] for name in names] == cells
    assert {one.unit for one in estimates.columns if one.name in names} == {"m^2/s^2"}


def test_each_field_of_an_estimate_is_in_its_table() -> None:
    columns = [one.name for one in tables_of(t.ESTIMATE)[0].columns]
    beginnings = {"mean": "x_m", "velocity_m_s": "velocity"}
    for name in get_type_hints(m.EntityEstimate):
        assert any(column.startswith(beginnings.get(name, name)) for column in columns), name


def test_columns_have_the_units_that_their_names_say() -> None:
    units = {one.name: one.unit for topic in (t.CAMERA_STATUS, t.VEHICLE_STATUS) for one in tables_of(topic)[0].columns}
    assert (units["edge_px"], units["clock_drift_ppm"], units["age_ms"], units["lands_in_s"]) == (
        "px",
        "ppm",
        "ms",
        "s",
    )

"""Forecasts of fields in which ranges locate the drones."""

from pathlib import Path

import msgspec
import pytest

from groundstation.field.resolved import ResolvedField
from groundstation.field.room import Ranging
from groundstation.forecast.failures import failures
from groundstation.forecast.floor import PlaceForecaster
from groundstation.forecast.ranged_places import RangedPlaces
from groundstation.forecast.team import team_of
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.vectors import Vector3

LINE = ((-3.0, 0.0, 2.6), (-1.0, 0.0, 2.6), (1.0, 0.0, 2.6), (3.0, 0.0, 2.6))
WALL_LINE = ((-3.0, 2.9, 2.6), (-1.0, 2.9, 2.6), (1.0, 2.9, 2.6), (3.0, 2.9, 2.6))
MIDDLE_PLANE = ((-3.0, 0.0, 0.2), (3.0, 0.0, 2.0), (3.0, 0.0, 4.0), (-3.0, 0.0, 2.0))
CEILING = ((-3.9, -2.9, 2.9), (3.9, -2.9, 2.9), (3.9, 2.9, 2.9), (-3.9, 2.9, 2.9))
CLUSTER = ((-0.5, -0.5, 2.6), (0.5, -0.5, 2.4), (0.5, 0.5, 2.9), (-0.5, 0.5, 2.5))


@pytest.fixture(scope="module")
def field() -> ResolvedField:
    return resolved_field(load_field(Path(__file__).parents[3] / "config" / "uwb-lab.yaml"))


def ranging(field: ResolvedField, places: tuple[Vector3, ...]) -> Ranging:
    anchors = {f"a{number}": place for number, place in enumerate(places)}
    return msgspec.structs.replace(field.ranging["uwb"], anchors=anchors)


def anchored(field: ResolvedField, places: tuple[Vector3, ...]) -> ResolvedField:
    return msgspec.structs.replace(field, ranging={"uwb": ranging(field, places)})


@pytest.mark.parametrize("places", [LINE, MIDDLE_PLANE])
def test_where_ranges_tell_no_place_nobody_locates_the_team(field: ResolvedField, places: tuple[Vector3, ...]) -> None:
    told = anchored(field, places)
    found = PlaceForecaster(told, team_of(told)).at((0.0, 0.5))
    assert found.std_m is None
    assert found.reason == "whoever sees it is not told in x and y by the ranges of uwb"


def test_whom_ranges_cannot_tell_nobody_locates_without_the_camera(field: ResolvedField) -> None:
    told = anchored(field, LINE)
    lost = {one.what: one.unlocalised for one in failures(told, team_of(told), [(0.0, 0.5)])}
    assert lost["drone_1's camera"] == ("drone_1", "drone_2", "turtlebot")


def test_what_ranges_tell_poorly_is_not_taken_from_the_beginning(field: ResolvedField) -> None:
    whole, poor = field, anchored(field, CLUSTER)
    good, bad = (PlaceForecaster(one, team_of(one)).at((2.3, 2.7)).std_m for one in (whole, poor))
    assert good is not None and 0.05 < good < 0.07
    assert bad is not None and 0.11 < bad < 0.14, "that of a filter that has never known the place"


@pytest.mark.parametrize(
    ("places", "told", "untold"),
    [
        (LINE, [], [(0.0, 0.0, 1.6), (0.0, 0.5, 0.1), (0.0, -0.5, 0.1), (2.0, 2.0, 1.1)]),
        (WALL_LINE, [], [(0.0, 0.0, 1.6), (2.0, -2.0, 0.1)]),
        (MIDDLE_PLANE, [], [(0.0, 0.0, 1.6), (0.0, 1.5, 1.6)]),
        (CEILING, [(0.0, 0.0, 0.1), (3.4, 2.5, 1.6), (-3.4, 0.0, 2.5)], []),
        (CLUSTER, [(0.0, 0.5, 1.6)], []),
        (CEILING[:3], [], [(0.0, 0.0, 1.6)]),
    ],
)
def test_places_are_told_where_the_drivers_fix_falls_on_them(
    field: ResolvedField, places: tuple[Vector3, ...], told: list[Vector3], untold: list[Vector3]
) -> None:
    judged = RangedPlaces(ranging(field, places))
    assert [point for point in told if not judged.tells(point)] == []
    assert [point for point in untold if judged.tells(point)] == []


def test_anchors_out_of_reach_tell_nothing(field: ResolvedField) -> None:
    system = field.ranging["uwb"]
    point = (3.4, 2.5, 1.6)
    assert RangedPlaces(system).tells(point)
    assert not RangedPlaces(msgspec.structs.replace(system, reach_m=5.0)).tells(point)

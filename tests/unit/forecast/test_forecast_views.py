"""The places that a team can see, and the reasons for the others."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from groundstation.field.resolved import ResolvedField
from groundstation.field.room import RoomObstacle
from groundstation.forecast.floor import OBSTACLE, PlaceForecast, PlaceForecaster, left_of
from groundstation.forecast.stands import StandSearch
from groundstation.forecast.team import Team, team_of
from groundstation.forecast.views import Link, Obstruction, Views
from groundstation.sensing.models import Box, Rectangle


@pytest.fixture
def team(lab_field: ResolvedField) -> Team:
    return team_of(lab_field)


def chain(team: Team, place: tuple[float, float]) -> tuple[Link, ...]:
    found = Views(team).chain_to(place)
    assert not isinstance(found, Obstruction), found
    return found


def test_one_drone_sees_the_middle_and_two_see_farther(team: Team) -> None:
    assert len(chain(team, (0.0, 0.0))) == 1
    assert len(chain(team, (3.0, 0.0))) == 2
    assert Views(team.without_robot("drone_2")).chain_to((3.0, 0.0)) is Obstruction.NOBODY_PLACES


def test_each_drone_of_a_chain_is_seen_by_the_one_above_and_the_last_by_the_ceiling(team: Team) -> None:
    views, (low, high) = Views(team), chain(team, (3.0, 0.0))
    assert views.sees(low.robot, low.pose, views.ground((3.0, 0.0))) > 0.0
    assert views.sees(high.robot, high.pose, views.marker(low.robot, low.pose)) > 0.0
    assert views.placed_by(views.marker(high.robot, high.pose), is_target=False) > 0.0
    assert views.placed({low.robot: low.pose, high.robot: high.pose}, (3.0, 0.0)) == {*team.robots, team.target}
    assert views.placed({low.robot: low.pose}, (3.0, 0.0)) == frozenset()


def test_a_corner_outside_of_all_views_is_blind_because_of_the_ceiling_camera(lab_field: ResolvedField) -> None:
    corner = PlaceForecaster(lab_field, team_of(lab_field)).at((3.9, 2.9))
    assert corner.std_m is None
    assert corner.reason == "whoever sees it is out of the view of ceiling"


def test_a_camera_whose_range_ends_is_named_for_its_range(team: Team) -> None:
    ceiling = team.sensors.world["ceiling"]
    short = replace(ceiling, view=replace(ceiling.view, range_m=1.0))
    near = replace(team, sensors=replace(team.sensors, world={"ceiling": short}))
    assert Views(near).chain_to((0.0, 0.0)) is Obstruction.NOBODY_PLACES
    assert Views(near).why_unplaced((0.0, 0.0)) == "beyond the range of ceiling"


def test_a_place_too_far_outside_of_the_fence_is_blind_for_the_fence(team: Team) -> None:
    narrow = replace(team, planner=replace(team.planner, fence=Rectangle((-0.5, 0.5), (-0.5, 0.5))))
    assert Views(narrow).chain_to((3.0, 0.0)) is Obstruction.OUT_OF_FENCE


def test_a_place_behind_walls_is_hidden(team: Team) -> None:
    walls = (
        Box((0.0, 0.3), (0.8, 0.1, 3.0)), Box((0.0, -0.3), (0.8, 0.1, 3.0)),
        Box((0.3, 0.0), (0.1, 0.8, 3.0)), Box((-0.3, 0.0), (0.1, 0.8, 3.0)),
    )  # fmt: skip
    walled = replace(team, sensors=replace(team.sensors, obstacles=walls))
    assert Views(walled).chain_to((0.0, 0.0)) is Obstruction.HIDDEN


def test_nobody_without_a_camera_sees_anything(team: Team) -> None:
    blind = team.without_sensor("drone_1").without_sensor("drone_2")
    assert Views(blind).chain_to((0.0, 0.0)) is Obstruction.NO_CAMERA


def test_a_drone_that_looks_up_sees_no_target(team: Team) -> None:
    upwards = {name: replace(one, tilt_down_rad=-1.0) for name, one in team.sensors.onboard.items()}
    assert Views(replace(team, sensors=replace(team.sensors, onboard=upwards))).chain_to((0.0, 0.0)) is (
        Obstruction.OUT_OF_SIGHT
    )


def test_no_target_stands_in_an_obstacle(lab_field: ResolvedField) -> None:
    crate = RoomObstacle(centre_m=(2.0, 0.0), size_m=(0.5, 0.5, 1.0))
    field = msgspec.structs.replace(lab_field, room=msgspec.structs.replace(lab_field.room, obstacles={"crate": crate}))
    assert PlaceForecaster(field, team_of(field)).at((2.1, 0.1)).reason == OBSTACLE


def test_the_planner_keeps_a_target_in_view_and_drones_apart_and_inside(team: Team) -> None:
    stand = StandSearch(team).at((2.0, 1.0))
    assert not isinstance(stand, Obstruction)
    assert team.target in stand.placed
    poses = np.array(list(stand.poses.values()))
    assert np.hypot(*(poses[0, :2] - poses[1, :2])) > 0.4
    assert all(team.planner.fence.nearest(*pose[:2]) == tuple(pose[:2]) for pose in poses)


def test_a_stand_that_the_planner_leaves_for_one_that_nobody_sees_counts_and_is_marked(
    team: Team, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, planned = (2.0, 1.0), StandSearch._planned
    search = StandSearch(team)
    stand = search.at(place)
    assert not isinstance(stand, Obstruction) and not stand.is_left
    monkeypatch.setattr(StandSearch, "_planned", lambda *given: replace(planned(*given), placed=frozenset()))
    left = search.at(place)
    assert not isinstance(left, Obstruction) and left.is_left and team.target in left.placed
    seen = PlaceForecast(place, left.std_m, "", left)
    assert left_of([seen, replace(seen, stand=stand), replace(seen, std_m=None)]) == 1

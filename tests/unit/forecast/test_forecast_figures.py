"""Standard deviations, observability and failures of a forecast, against values computed by hand."""

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from groundstation.field.resolved import ResolvedField
from groundstation.forecast.endurance import endurance_of
from groundstation.forecast.failures import failures, teams_without_one
from groundstation.forecast.floor import FloorMap, PlaceForecast, PlaceForecaster, spread_of
from groundstation.forecast.flown_filter import FlownFilter
from groundstation.forecast.observability import Observability, observe, topologies_of
from groundstation.forecast.paths import spaced
from groundstation.forecast.team import Team, team_of
from groundstation.sensing.models import Rectangle
from groundstation.sensing.topology import Topology

MIDDLE = (0.0, 0.0)


@pytest.fixture
def team(lab_field: ResolvedField) -> Team:
    return team_of(lab_field)


def test_a_still_target_under_a_perfectly_mounted_camera_is_known_to_the_mean_of_its_sightings(
    lab_field: ResolvedField,
) -> None:
    ceiling = msgspec.structs.replace(
        lab_field.cameras["ceiling"], observes=("robots", "targets"), attitude_std_deg=1e-4, position_std_m=1e-5
    )
    still = msgspec.structs.replace(
        lab_field.tracked["turtlebot"], model="constant_velocity", acceleration_std_m_s2=1e-5, max_speed_m_s=1e-4
    )
    field = msgspec.structs.replace(lab_field, cameras={"ceiling": ceiling}, target=still)
    belief = FlownFilter(field, team_of(field)).belief({}, MIDDLE, 1.5, ())
    found = math.sqrt(np.trace(belief.covariance_of("turtlebot")[:2, :2]))
    sightings = 18  # at 12 Hz
    assert found == pytest.approx(math.sqrt(2.0) * 0.015 / math.sqrt(sightings), rel=0.02)


def test_more_cameras_on_a_target_tell_more(lab_field: ResolvedField, team: Team) -> None:
    both = PlaceForecaster(lab_field, team).at(MIDDLE).std_m
    alone = PlaceForecaster(lab_field, team.without_robot("drone_2")).at(MIDDLE).std_m
    assert both is not None and alone is not None
    assert 0.02 < both < alone < 0.08


def seen(field: ResolvedField, team: Team) -> Observability:
    (found,) = observe(field, team, MIDDLE, [Topology.flat(team.robots)])
    return found


def test_with_the_ceiling_camera_all_places_and_headings_are_told(lab_field: ResolvedField, team: Team) -> None:
    found = seen(lab_field, team)
    core = {f"{name}.{part}" for name in team.robots for part in ("x", "y", "z", "yaw")}
    assert not (core | {"turtlebot.x", "turtlebot.y"}) & set(found.untold)
    assert {"ceiling.yaw", "drone_1.velocity_scale"} <= set(found.untold)
    assert found.missing == ()
    assert found.worst_m is not None and found.worst_m.std < 0.06
    assert found.worst_yaw is not None and found.worst_yaw.std < math.radians(3.0)
    assert found.rank >= len(core) + 2


def test_without_the_ceiling_camera_nobody_is_told_where_he_is(lab_field: ResolvedField, team: Team) -> None:
    lost = seen(lab_field, team.without_sensor("ceiling"))
    whole = seen(lab_field, team)
    places = {f"{name}.{part}" for name in team.robots for part in ("x", "y")}
    assert places <= set(lost.untold)
    assert lost.worst_m is not None and lost.worst_m.std > 5.0
    assert {name.split(".")[1] for name, _ in lost.worst_m.parts} <= {"x", "y"}
    assert lost.rank <= whole.rank - 3  # the room may be shifted along two axes, and rotated


def test_a_drone_that_looks_away_leaves_the_target_missing(lab_field: ResolvedField, team: Team) -> None:
    blind = team.without_sensor("drone_1").without_sensor("drone_2")
    assert seen(lab_field, blind).missing == ("turtlebot",)


def test_all_topologies_of_a_small_team_are_looked_at(team: Team) -> None:
    assert {str(one) for one in topologies_of(team, ())} == {"drone_1,drone_2", "drone_1/drone_2", "drone_2/drone_1"}
    many = replace(team, robots=("a", "b", "c", "d"))
    chosen = Topology.parse("a,b/c,d")
    assert chosen in topologies_of(many, [chosen])
    assert len(topologies_of(many, [chosen])) <= 3


def test_each_failure_is_judged_and_names_whom_nobody_places(lab_field: ResolvedField, team: Team) -> None:
    found = {one.what: one for one in failures(lab_field, team, [MIDDLE, (3.0, 0.0)])}
    assert list(found) == ["ceiling", "drone_1's camera", "drone_2's camera", "drone_1", "drone_2"]
    assert found["ceiling"].unlocalised == ("drone_1", "drone_2", "turtlebot")
    assert found["ceiling"].without.blind == 1.0
    for what in ("drone_1's camera", "drone_2"):
        assert found[what].unlocalised == ()
        assert found[what].without.blind == 0.5, "one camera alone sees the middle, and not what is 3 m aside"


def test_a_team_of_one_has_nothing_left_without_it(lab_field: ResolvedField, team: Team) -> None:
    single = team.without_robot("drone_2")
    assert [what for what, _ in teams_without_one(single)] == ["ceiling", "drone_1's camera", "drone_1"]
    last = failures(lab_field, single, [MIDDLE])[-1]
    assert (last.without.blind, last.unlocalised) == (1.0, ("turtlebot",))


def test_a_ceiling_camera_that_observes_targets_tracks_on_when_the_only_drone_fails(lab_field: ResolvedField) -> None:
    cameras = {
        name: msgspec.structs.replace(one, observes=("robots", "targets")) for name, one in lab_field.cameras.items()
    }
    field = msgspec.structs.replace(lab_field, cameras=cameras, drones={"drone_1": lab_field.drones["drone_1"]})
    last = failures(field, team_of(field), [MIDDLE, (3.9, 2.9)])[-1]
    assert (last.what, last.without.blind, last.unlocalised) == ("drone_1", 0.5, ())
    assert last.without.median_m is not None and 0.0 < last.without.median_m < 0.1


def test_drones_that_see_no_target_are_located_where_fixed_cameras_see_them(
    lab_field: ResolvedField, team: Team
) -> None:
    blind = team.without_sensor("drone_2")
    found = {one.what: one for one in failures(lab_field, blind, [MIDDLE])}
    assert found["drone_1's camera"].unlocalised == ("turtlebot",)
    assert found["ceiling"].unlocalised == ("drone_1", "drone_2", "turtlebot")
    outside = replace(blind, planner=replace(blind.planner, fence=Rectangle((1.0, 2.0), (1.0, 2.0))))
    (lost,) = (one for one in failures(lab_field, outside, [MIDDLE]) if one.what == "drone_1's camera")
    assert lost.unlocalised == ("drone_1", "drone_2", "turtlebot")


def test_batteries_last_as_their_kind_tells_down_to_where_they_land(lab_field: ResolvedField) -> None:
    assert [one.seconds for one in endurance_of(lab_field)] == [pytest.approx(0.85 * 720.0)] * 2
    untold = msgspec.structs.replace(lab_field.drones["drone_1"], kind="mavlink")
    field = msgspec.structs.replace(lab_field, drones={"drone_1": untold})
    assert endurance_of(field)[0].seconds is None


def test_blind_regions_are_connected_and_of_one_reason() -> None:
    def place(x: float, y: float) -> PlaceForecast:
        reason = "far" if x < 1.0 and y > 0.0 else "hidden" if x < 1.0 else ""
        return PlaceForecast((x, y), None if reason else 0.1 * x, reason)

    xs, ys = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0])
    floor = FloorMap(xs, ys, tuple(tuple(place(x, y) for x in xs.tolist()) for y in ys.tolist()))
    first, second = floor.regions()
    assert (first.reason, first.x_m, first.y_m) == ("far", (-0.5, 0.5), (0.5, 2.5))
    assert second.reason == "hidden"
    assert [one.share for one in (first, second)] == pytest.approx([2 / 9, 1 / 9])
    spread = spread_of(floor.places)
    assert (spread.median_m, spread.worst_m, spread.blind) == pytest.approx((0.15, 0.2, 1 / 3))
    assert np.isnan(floor.std_m[:, 0]).all()


def test_a_path_is_walked_in_even_steps() -> None:
    assert spaced([(0.0, 0.0), (1.0, 0.0), (1.0, 3.0)], 5) == [(0, 0), (1, 0), (1, 1), (1, 2), (1, 3)]
    assert spaced([(2.0, 1.0)], 5) == [(2.0, 1.0)]
    assert spaced([], 5) == []

"""A team without its target covers the whole room, each robot from its own stand; pictures update the maps."""

import math
from dataclasses import replace

import numpy as np
import pytest
from searching_team import CONFIG, CONTROL, NAMES, SEARCH, SENSORS, belief, new_search, picture, sighting

from groundstation.control.coverage import choose_stands
from groundstation.control.parameters import ControlParameters
from groundstation.control.search_parameters import SearchParameters, search_from_field
from groundstation.control.search_state import SearchMode
from groundstation.control.sweeps import lattice_of
from groundstation.control.target_search import Search
from groundstation.estimation.room_map import RoomGrid
from groundstation.sensing.detection import detection
from groundstation.sensing.footprint import footprint_of
from groundstation.sensing.models import Box, SensorSuite
from groundstation.sensing.visibility import camera_rows
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

TICK_S = 0.1


def fly(
    place: tuple[float, float],
    limit_s: float = 60.0,
    parameters: SearchParameters = SEARCH,
    control: ControlParameters = CONTROL,
    sensors: SensorSuite = SENSORS,
) -> tuple[float, float, Search]:
    """Return when two drones that fly from stand to stand see a target at rest, and their stands' least distance."""
    search, rng = new_search(parameters, sensors, control), np.random.default_rng(1)
    height_m = control.search_height_m
    poses = {name: np.array([-0.5, y, height_m, 0.0]) for name, y in zip(NAMES, (0.5, -0.5), strict=True)}
    cameras = {name: camera_rows([SENSORS.onboard[name]], SENSORS.softness)[0] for name in NAMES}
    nearest = math.inf
    for tick in range(round(limit_s / TICK_S)):
        now_s = TICK_S * (tick + 1)
        now = belief(poses, now_s)
        for name in NAMES:
            if tick % 5 == 0:
                seen = detection(cameras[name], poses[name], 0.0, *place, 0.4) > rng.random()
                if seen:
                    return now_s, nearest, search
                search.take(picture(name, now_s))
        search.advance(now, {"turtlebot": math.inf})
        stands = search.stands(NAMES, ("turtlebot",), now)
        if len(stands) == 2:
            a, b = stands.values()
            nearest = min(nearest, math.hypot(a.x - b.x, a.y - b.y))
        for name, stand in stands.items():
            way = np.array([stand.x, stand.y]) - poses[name][:2]
            poses[name][:2] += way * min(1.0, SEARCH.speed_m_s * TICK_S / max(float(np.hypot(*way)), 1e-9))
            turn = math.remainder(stand.yaw - poses[name][3], math.tau)
            poses[name][3] += max(-0.08, min(0.08, turn))
    return limit_s, nearest, search


def test_a_target_at_rest_is_found_wherever_it_stands_and_stands_are_apart() -> None:
    """Although its marker is found at less distance than the search assumes; chance decides which place takes long."""
    places = ((2.8, 1.8), (-3.5, -2.5), (3.5, -2.5), (-3.6, 0.0), (0.0, 2.6), (2.0, -1.0))
    flights = [fly(place, limit_s=90.0) for place in places]
    assert max(one[0] for one in flights) < 75.0
    assert min(one[1] for one in flights) >= SEARCH.apart_m - 1e-9


@pytest.mark.slow
@pytest.mark.study
def test_targets_all_over_the_room_are_found_sooner_from_where_more_of_it_is_seen() -> None:
    """Single places show little: a search that misses by chance goes round the room once more."""
    places = np.random.default_rng(11).uniform((-3.8, -2.8), (3.8, 2.8), (50, 2)).tolist()
    found_s = [fly((x, y))[0] for x, y in places]
    higher = replace(CONTROL, search_height_m=1.6)  # the first level's height, at which searches flew before
    higher_s = [fly((x, y), control=higher)[0] for x, y in places]
    assert np.mean(found_s) < 17.0  # turning on arrival only: 32 s at six places
    assert np.mean(found_s) < np.mean(higher_s) - 2.0


def test_a_searcher_turns_all_the_time_towards_what_it_has_not_seen() -> None:
    search, lattice = new_search(), lattice_of(RoomGrid.over(*SEARCH.room_m), SEARCH)
    chances = np.zeros(search.grid.shape)
    chances[int(np.argmin(np.abs(search.grid.ys - 1.5))), int(np.argmin(np.abs(search.grid.xs)))] = 1.0
    view = footprint_of(SENSORS.onboard["drone_1"], search.grid.cell_m, 1.6, 0.4, SENSORS.softness)
    poses, anywhen = {"drone_1": np.array([0.0, 0.0, 1.6, 0.0])}, {"drone_1": np.full(len(lattice.places), math.inf)}
    outlook = choose_stands(chances, lattice, {"drone_1": view}, poses, anywhen, {}, SEARCH)
    assert outlook.sweeps["drone_1"].direction == 1
    assert outlook.stands["drone_1"].yaw > 1.0
    assert outlook.chance > 0.5
    again = choose_stands(chances, lattice, {"drone_1": view}, poses, anywhen, outlook.sweeps, SEARCH)
    assert again.sweeps == outlook.sweeps


@pytest.mark.parametrize("known", [None, (1.0, 0.0)])
def test_a_search_for_a_previously_tracked_target_turns_faster(known: tuple[float, float] | None) -> None:
    search, ages_s = new_search(), (0.0, 2.0) if known else (math.inf, math.inf)
    poses = {
        "drone_1": np.array([-0.5, 0.5, CONTROL.search_height_m, 0.0]),
        "drone_2": np.array([-0.5, -0.5, CONTROL.search_height_m, 0.0]),
    }
    for stamp_s, age_s in zip((1.0, 3.0), ages_s, strict=True):
        now = belief(poses, stamp_s, known)
        search.advance(now, {"turtlebot": age_s})
    rates = {stand.turn_rad_s for stand in search.stands(NAMES, ("turtlebot",), now).values()}
    assert rates == {SEARCH.near_yaw_rate_rad_s if known else SEARCH.yaw_rate_rad_s}


def test_pictures_are_searched_as_far_as_a_full_search_finds_markers() -> None:
    assert SEARCH.ranges_m["drone_1"] == pytest.approx(460 * 0.044 / 8.8)
    far = resolved_field(load_field(CONFIG / "lab.yaml", ("planner.planned_range_m=3.0",)))
    assert search_from_field(far).ranges_m["drone_1"] == 3.0
    search, poses = new_search(), {"drone_1": np.array([0.0, 0.0, 1.6, 0.0])}
    search.advance(belief(poses, 0.02), {"turtlebot": math.inf})
    before = search.targets["turtlebot"].room
    search.take(picture("drone_1", 0.02))
    search.advance(belief(poses, 0.04), {"turtlebot": math.inf})
    after = search.targets["turtlebot"].room
    assert before is not None
    assert after is not None
    ahead, behind = (int(np.argmin(np.abs(search.grid.xs - x))) for x in (1.8, -1.8))
    row = int(np.argmin(np.abs(search.grid.ys)))
    assert after.chances[row, ahead] < 0.6 * before.chances[row, ahead]
    assert after.chances[row, behind] > before.chances[row, behind]


def test_floor_hidden_by_an_obstacle_does_not_count_as_searched() -> None:
    poses, maps = {"drone_1": np.array([0.0, 0.0, 1.6, 0.0])}, []
    for boxes in ((), (Box((1.3, 0.0), (0.2, 1.6, 1.3)),)):
        search = new_search(sensors=replace(SENSORS, obstacles=boxes))
        search.advance(belief(poses, 0.02), {"turtlebot": math.inf})
        search.take(picture("drone_1", 0.02))
        search.advance(belief(poses, 0.04), {"turtlebot": math.inf})
        room = search.targets["turtlebot"].room
        assert room is not None
        maps.append(room.overlooked)
    ahead, row = int(np.argmin(np.abs(search.grid.xs - 1.7))), int(np.argmin(np.abs(search.grid.ys)))
    assert maps[0][row, ahead] < 0.5
    assert maps[1][row, ahead] > 0.95
    assert maps[1].min() < 0.5  # before it


@pytest.mark.parametrize(
    ("room_m", "fence_x_m", "fence_y_m"),
    [
        ((200.0, 4.0), (-99.0, 99.0), (-0.8, 0.8)),
        ((60.0, 40.0), (3.0, 3.6), (-5.0, 5.0)),
    ],
)
def test_a_narrow_fence_in_a_large_room_has_stands(
    room_m: tuple[float, float], fence_x_m: tuple[float, float], fence_y_m: tuple[float, float]
) -> None:
    """Cells of 0.6 to 1 m: every other one missed the fence, and the team never searched."""
    grid = RoomGrid.over(*room_m)
    lattice = lattice_of(grid, replace(SEARCH, room_m=room_m, fence_x_m=fence_x_m, fence_y_m=fence_y_m))
    assert len(lattice.places) and (lattice.places >= (fence_x_m[0], fence_y_m[0])).all()
    assert (lattice.places <= (fence_x_m[1], fence_y_m[1])).all()
    assert np.array_equal(lattice.cells(lattice.places), (lattice.rows, lattice.columns))
    assert (
        np.abs(np.array([grid.xs[lattice.columns], grid.ys[lattice.rows]]).T - lattice.places) <= 0.5 * grid.cell_m
    ).all()


def test_each_searches_on_its_own_side_whoever_is_nearer_to_the_middle() -> None:
    search, lattice = new_search(), lattice_of(RoomGrid.over(*SEARCH.room_m), SEARCH)
    chances = np.zeros(search.grid.shape)
    for x, share in ((-3.0, 0.6), (0.8, 0.4)):
        chances[int(np.argmin(np.abs(search.grid.ys))), int(np.argmin(np.abs(search.grid.xs - x)))] = share
    poses = {"near": np.array([-0.2, 0.0, 1.6, 0.0]), "far": np.array([-1.4, 0.0, 1.6, math.pi])}
    view = footprint_of(SENSORS.onboard["drone_1"], search.grid.cell_m, 1.6, 0.4, SENSORS.softness)
    anywhen = dict.fromkeys(poses, np.full(len(lattice.places), math.inf))
    for names in (("near", "far"), ("far", "near")):
        stands = choose_stands(chances, lattice, dict.fromkeys(names, view), poses, anywhen, {}, SEARCH).stands
        assert stands["far"].x < -1.0 < stands["near"].x


def test_a_target_that_is_nowhere_is_said_to_be_lost_when_the_room_was_searched() -> None:
    soon = replace(SEARCH, lost_after_s=5.0, lost_excluded=0.2)
    before = fly((30.0, 0.0), 3.0, soon)[2].targets["turtlebot"]
    after = fly((30.0, 0.0), 14.0, soon)[2].targets["turtlebot"]
    assert (before.mode, after.mode) == (SearchMode.SEARCH, SearchMode.LOST)
    assert after.excluded > 0.2 > before.excluded > 0.01
    assert before.expected_s is not None
    assert before.expected_s > 5.0


def test_a_room_with_a_box_is_searched_around_it_and_to_its_end() -> None:
    """What is in the box is never seen: drones circled it, and the search never ended."""
    sensors = replace(SENSORS, obstacles=(Box((2.0, 0.0), (3.0, 2.6, 0.75)),))
    search = fly((30.0, 0.0), 60.0, replace(SEARCH, lost_after_s=5.0), sensors=sensors)[2]
    found = search.targets["turtlebot"]
    assert found.mode is SearchMode.LOST and found.excluded > 0.9
    assert found.place is not None and found.place == search.likeliest("turtlebot")
    assert not (0.5 < found.place[0] < 3.5 and abs(found.place[1]) < 1.3)


def test_floor_that_no_permitted_stand_shows_is_not_waited_for() -> None:
    assert new_search().never_shown == 0.0
    fenced = replace(SEARCH, fence_x_m=(-1.0, 1.0), fence_y_m=(-0.8, 0.8), lost_after_s=5.0)
    search = fly((30.0, 0.0), 30.0, fenced)[2]
    state = search.targets["turtlebot"]
    assert state.mode is SearchMode.LOST
    assert state.room is not None and state.room.excluded(np.ones(search.grid.shape, dtype=np.bool_)) < 0.7
    assert search.never_shown > 0.3


def test_a_room_far_larger_than_the_way_out_of_its_view_is_partly_never_shown() -> None:
    hall = replace(SEARCH, room_m=(20.0, 12.0), fence_x_m=(-9.7, 9.7), fence_y_m=(-5.7, 5.7))
    assert 0.4 < new_search(hall).never_shown < 0.7
    assert new_search(hall, replace(SENSORS, world={})).never_shown == 0.0
    only_fed = replace(CONTROL, fed=frozenset(NAMES))
    assert new_search(hall, control=only_fed).never_shown > new_search(hall).never_shown


def test_a_target_that_pictures_do_not_show_may_be_hidden_and_then_is_no_longer_where_it_was() -> None:
    search, poses = new_search(), {"drone_1": np.array([0.0, 0.0, 1.6, 0.0])}
    for tick in range(150):
        now_s, age_s = 0.02 * (tick + 1), 0.02 * tick
        if tick >= 50 and tick % 8 == 0:
            search.take(picture("drone_1", now_s))
        gone = search.advance(belief(poses, now_s, (1.0, 0.0)), {"turtlebot": age_s})
        if tick < 50:
            assert search.targets["turtlebot"].mode is SearchMode.TRACK
        if gone:
            break
    assert gone == ("turtlebot",)
    assert age_s > 1.9
    assert search.is_missing("turtlebot")
    search.advance(belief(poses, now_s + 0.02, (2.0, 1.0)), {"turtlebot": 0.1})
    assert search.targets["turtlebot"].mode is SearchMode.TRACK
    assert search.targets["turtlebot"].room is None


def given_up_after_s(bearing_deg: float, sooner_s: float) -> float:
    """Return the time unseen after which a target at (1, 0) is given up.

    bearing_deg: of drone_2 from there; drone_1's is 180; sooner_s: how much earlier than drone_1 drone_2 saw it last.
    """
    search, bearing = new_search(), math.radians(bearing_deg)
    poses = {
        "drone_1": np.array([0.0, 0.0, 1.6, 0.0]),
        "drone_2": np.array([1.0 + math.cos(bearing), math.sin(bearing), 1.6, bearing + math.pi]),
    }
    for tick in range(1, 200):
        now_s, age_s = 0.02 * tick, max(0.0, 0.02 * tick - 1.0)
        for name, last_s in zip(NAMES, (1.0, 1.0 - sooner_s), strict=True):
            if now_s <= last_s:
                search.see(sighting(name, now_s))
            elif tick % 8 == 0:
                search.take(picture(name, now_s))
        if search.advance(belief(poses, now_s, (1.0, 0.0)), {"turtlebot": age_s}):
            return age_s
    return math.inf


def test_a_target_that_two_sides_lose_at_once_is_not_hidden_by_a_passer_by() -> None:
    assert given_up_after_s(bearing_deg=-90.0, sooner_s=0.06) < 1.2
    assert given_up_after_s(bearing_deg=-90.0, sooner_s=0.3) > 1.9
    assert given_up_after_s(bearing_deg=170.0, sooner_s=0.0) > 1.9


def test_pictures_that_show_it_or_look_elsewhere_change_nothing() -> None:
    search, poses = new_search(), {"drone_1": np.array([0.0, 0.0, 1.6, math.pi])}
    search.advance(belief(poses, 0.01, (1.0, 0.0)), {"turtlebot": 0.1})
    for tick in range(60):
        now_s = 0.02 * (tick + 1)
        search.take(picture("drone_1", now_s))
        search.take(picture("ceiling", now_s))
        search.take(picture("nobody", now_s))
        assert search.advance(belief(poses, now_s, (1.0, 0.0)), {"turtlebot": 1.0}) == ()
    assert search.targets["turtlebot"].mode is SearchMode.TRACK


def test_the_same_pictures_give_the_same_maps_to_the_bit() -> None:
    first, second = fly((3.5, -2.5), 6.0)[2], fly((3.5, -2.5), 6.0)[2]
    a, b = first.targets["turtlebot"].room, second.targets["turtlebot"].room
    assert a is not None
    assert b is not None
    assert np.array_equal(a.chances, b.chances)

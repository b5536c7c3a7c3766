"""What counts in a search: pictures of cameras at known places, once; robots that see and obey; real time."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from searching_team import CONFIG, CONTROL, NAMES, SEARCH, SENSORS, belief, new_search, picture, sighting

from groundstation.control.search_parameters import search_from_field
from groundstation.control.search_ranges import searching_cameras
from groundstation.control.search_reach import extra_ways_m, permitted, shown_from
from groundstation.control.search_state import SearchMode
from groundstation.control.sweeps import lattice_of
from groundstation.control.target_search import Search
from groundstation.estimation.room_map import HIDDEN_S
from groundstation.sensing.footprint import footprint_of
from groundstation.sensing.from_field import sensors_from_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

WATCHED = resolved_field(load_field(CONFIG / "lab.yaml", ("cameras.ceiling.observes=[robots, targets]",)))
POSES = {
    "drone_1": np.array([-0.5, 0.5, CONTROL.search_height_m, 0.0]),
    "drone_2": np.array([-0.5, -0.5, CONTROL.search_height_m, 0.0]),
}
TARGET = (0.3, 0.1)


def overlooked(search: Search) -> float:
    room = search.targets["turtlebot"].room
    assert room is not None
    return float(room.overlooked.min())


def hidden_in(search: Search) -> float:
    room = search.targets["turtlebot"].room
    assert room is not None
    return float(room.hidden.sum())


@pytest.mark.parametrize(("age_s", "counts"), [(0.05, True), (0.9, True), (1.01, False), (30.0, False)])
def test_pictures_of_a_fixed_camera_count_no_longer_than_those_of_a_drone(age_s: float, counts: bool) -> None:
    search = new_search(search_from_field(WATCHED), sensors_from_field(WATCHED))
    for tick in range(800, 850):
        now_s = 0.05 * tick
        if tick == 849:
            search.take(picture("ceiling", now_s - age_s))
        search.advance(belief(POSES, now_s, TARGET), {"turtlebot": 0.05 * (tick - 800)})
    assert (overlooked(search) < 0.9) is counts


@pytest.mark.parametrize(("seen_s", "counts"), [(1.0, True), (1.3, False)])
def test_a_picture_does_not_count_against_a_target_that_was_seen_since(seen_s: float, counts: bool) -> None:
    search = new_search()
    search.see(sighting("drone_2", seen_s))
    search.advance(belief(POSES, 1.2), {"turtlebot": 0.2})
    search.advance(belief(POSES, 1.95, TARGET), {"turtlebot": 1.95 - seen_s})
    search.take(picture("drone_1", 1.2))
    search.advance(belief(POSES, 2.0, TARGET), {"turtlebot": 2.0 - seen_s})
    assert (overlooked(search) < 0.9) is counts


def test_pictures_of_a_drone_that_may_be_elsewhere_do_not_count() -> None:
    for misplaced, counts in (((), True), (("drone_1",), False), (("drone_2",), True)):
        search = new_search()
        search.advance(belief(POSES, 1.0), {"turtlebot": math.inf}, misplaced)
        search.take(picture("drone_1", 1.0))
        search.advance(belief(POSES, 1.02), {"turtlebot": math.inf}, misplaced)
        assert (overlooked(search) < 0.9) is counts


@pytest.mark.parametrize("tick_s", [0.02, 0.023, 0.06, 0.099, 0.1, 0.14, 1.7])
def test_maps_move_on_as_fast_as_time_passes_however_beliefs_come(tick_s: float) -> None:
    """Each step waited for the first belief after 100 ms and counted 100 ms: a tenth was lost."""
    search = new_search()
    hidden = []
    for tick in range(1, round(6.0 / tick_s)):
        now_s = 40.0 + tick_s * tick
        search.advance(belief(POSES, now_s, TARGET), {"turtlebot": 1.0})
        hidden.append((now_s, hidden_in(search)))
    (begun_s, first), (end_s, last) = hidden[0], hidden[-1]
    assert HIDDEN_S * math.log(first / last) == pytest.approx(end_s - begun_s, abs=0.101)


def test_a_pause_of_the_tracker_lets_maps_move_no_further_than_two_seconds() -> None:
    search = new_search()
    search.advance(belief(POSES, 40.0, TARGET), {"turtlebot": 1.0})
    first = hidden_in(search)
    search.advance(belief(POSES, 100.0, TARGET), {"turtlebot": 1.0})
    last = hidden_in(search)
    assert HIDDEN_S * math.log(first / last) == pytest.approx(2.0, abs=0.01)


def searching(search: Search, seconds: float, from_s: float, sending: Sequence[str], flying: Sequence[str] = NAMES,
              unsteered: Sequence[str] = (), every: int = 3) -> set[str]:  # fmt: skip
    """Search for some seconds, with pictures of some drones at every so many tenths; return who got stands at the end.

    The target is found nowhere.
    """
    poses = {name: POSES[name] for name in flying}
    for tick in range(round(seconds * 10)):
        now_s = from_s + 0.1 * tick
        for name in sending if tick % every == 0 else ():
            search.take(picture(name, now_s))
        now = belief(poses, now_s)
        search.advance(now, {"turtlebot": math.inf}, (), unsteered)
        stands = search.stands(flying, ("turtlebot",), now)
    return set(stands)


def test_a_drone_whose_pictures_stay_away_gets_no_stand_until_they_come_again() -> None:
    search = new_search()
    assert searching(search, 2.0, 1.0, NAMES) == set(NAMES)
    assert searching(search, 2.5, 3.0, ("drone_1",)) == set(NAMES), "not yet"
    assert searching(search, 1.0, 5.5, ("drone_1",)) == {"drone_1"}
    assert searching(search, 0.2, 6.5, NAMES) == {"drone_1"}, "a single picture"
    assert searching(search, 0.2, 6.7, NAMES) == set(NAMES)
    assert searching(search, 3.5, 6.9, ()) == set(), "nobody sees: nobody searches"


def test_a_drone_that_has_just_joined_searches_and_one_that_never_sends_a_picture_soon_does_not() -> None:
    search = new_search()
    assert searching(search, 1.0, 1.0, ("drone_1",)) == set(NAMES)
    assert searching(search, 3.0, 2.0, ("drone_1",)) == {"drone_1"}


@pytest.mark.parametrize(("every", "changes"), [(20, 0), (29, 0), (31, 1), (35, 1)])
def test_a_slow_camera_is_not_trusted_and_distrusted_in_turn(every: int, changes: int) -> None:
    search, told = new_search(), []
    for turn in range(60):
        sending = NAMES if turn * 5 % every < 5 else ("drone_1",)
        told.append("drone_2" in searching(search, 0.5, 1.0 + 0.5 * turn, sending, every=5))
    assert sum(a != b for a, b in pairwise(told)) == changes


HALL = replace(SEARCH, room_m=(12.0, 8.0), fence_x_m=(-5.7, 5.7), fence_y_m=(-3.7, 3.7), lost_after_s=5.0)
NEAR = replace(CONTROL, fed=frozenset({"drone_2"}))


def half_reaching() -> Search:
    """Return a search in which drone_2, which flies on our estimate, does not reach all of a large room."""
    return new_search(HALL, control=NEAR)


@pytest.mark.parametrize("how", ["landed", "silent", "waits", "stays"])
def test_floor_that_only_a_drone_without_part_in_the_search_could_show_is_not_waited_for(how: str) -> None:
    search = half_reaching()
    searching(search, 1.0, 1.0, NAMES)
    before = search.never_shown
    flying = NAMES[1:] if how == "landed" else NAMES
    sending = NAMES[1:] if how in ("landed", "silent") else NAMES
    unsteered = NAMES[:1] if how == "waits" else ()
    searching(search, 9.0, 2.0, sending, flying, unsteered)
    if how in ("silent", "waits"):
        assert search.never_shown == before, "a failsafe may end as well"
    searching(search, 2.0, 11.0, sending, flying, unsteered)
    assert (search.never_shown > before + 0.1) is (how != "stays")
    searching(search, 12.0, 13.0, (), flying)
    assert (search.never_shown > before + 0.1) is (how != "stays"), "nobody can search: nothing changes"


def test_a_search_whose_far_reaching_drone_dropped_out_ends() -> None:
    """It waited for 85 % of what the team of the beginning could show, of which those left see less."""
    search = half_reaching()
    searching(search, 1.0, 1.0, NAMES)
    room = search.targets["turtlebot"].room
    assert room is not None
    lattice = lattice_of(search.grid, HALL)
    way_m = extra_ways_m("drone_2", lattice.places, NEAR, SENSORS)
    free = permitted("drone_2", lattice.places, way_m, HALL, NEAR, SENSORS)
    camera = searching_cameras(SENSORS.onboard, HALL.ranges_m)["drone_2"]
    height_m, softness = CONTROL.search_height_m, SENSORS.softness
    view = footprint_of(camera, search.grid.cell_m, height_m, SENSORS.marker_height_m["turtlebot"], softness)
    near = shown_from(search.grid, lattice, free, view)
    assert near.mean() < 0.7
    searched = replace(room, overlooked=np.where(near, 0.01, 1.0))  # as if it had flown round all that it reaches
    search.targets["turtlebot"] = replace(search.targets["turtlebot"], room=searched)
    searching(search, 7.0, 2.0, NAMES[1:], NAMES)
    modes = [search.targets["turtlebot"].mode]
    searching(search, 1.0, 9.0, NAMES[1:], NAMES[1:])
    modes.append(search.targets["turtlebot"].mode)
    assert modes == [SearchMode.SEARCH, SearchMode.LOST], "drone_1 was still there, blind; then it landed"

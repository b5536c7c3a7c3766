"""What counts in a search: pictures of cameras at known places, once; robots that see and obey; real time."""

import math

import numpy as np
import pytest
from searching_team import CONFIG, CONTROL, belief, new_search, picture, sighting

from groundstation.control.search_parameters import search_from_field
from groundstation.control.target_search import Search
from groundstation.estimation.room_map import HIDDEN_S
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

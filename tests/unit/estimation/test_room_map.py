"""The map of an unseen target: bounded by walls, moved with time, and cleared by pictures without the target."""

import numpy as np
import pytest

from groundstation.estimation.room_map import HIDDEN_S, RoomGrid, RoomMap, lost_at, unknown_place

GRID = RoomGrid.over(8.0, 6.0)
EVERYWHERE = np.ones(GRID.shape, dtype=np.bool_)


def seen_within(x: float, y: float, radius: float, chance: float = 0.7) -> np.ndarray:
    return chance * (np.hypot(GRID.xs[None, :] - x, GRID.ys[:, None] - y) < radius)


def test_cells_cover_the_room_and_never_become_too_many() -> None:
    assert GRID.shape == (30, 40)
    assert GRID.xs[[0, -1]] == pytest.approx([-3.9, 3.9])
    assert GRID.ys[[0, -1]] == pytest.approx([-2.9, 2.9])
    hall = RoomGrid.over(60.0, 40.0)
    assert hall.shape[0] * hall.shape[1] <= 2500


def test_a_lost_target_is_mostly_where_it_was_predicted_and_a_little_anywhere() -> None:
    room = lost_at(GRID, (1.0, -0.5), 0.04 * np.eye(2))
    assert room.chances.sum() == pytest.approx(1.0)
    assert room.likeliest(EVERYWHERE) == pytest.approx((0.9, -0.5), abs=0.11)
    near = room.mass_near((1.0, -0.5), 0.04 * np.eye(2), 2.0, 0.5)
    assert 0.55 < near < 0.75
    assert room.chances.min() > 0.0


def test_a_target_that_two_sides_lost_at_once_is_hardly_hidden() -> None:
    usual, at_once = (lost_at(GRID, (1.0, -0.5), 0.04 * np.eye(2), once) for once in (False, True))
    assert at_once.chances.sum() == pytest.approx(1.0)
    assert usual.hidden.sum() == pytest.approx(0.3)
    assert at_once.hidden.sum() < 0.05
    assert at_once.goes_on.sum() > usual.goes_on.sum()


def test_a_target_that_was_never_seen_is_rather_where_a_hint_says() -> None:
    room = unknown_place(GRID, [(-0.5, 0.5), (-0.5, -0.5)])
    assert room.chances.sum() == pytest.approx(1.0)
    assert room.likeliest(EVERYWHERE) == pytest.approx((-0.5, 0.0), abs=0.11)
    assert room.chances.min() > 0.4 / room.chances.size


def test_walls_keep_in_what_drives_and_what_stands_stays() -> None:
    room = lost_at(GRID, (3.9, 2.9), 0.01 * np.eye(2)).given_up()
    moved = room
    for _ in range(100):
        moved = moved.moved(0.018)
    assert moved.drives.sum() == pytest.approx(room.drives.sum())
    assert np.array_equal(moved.stands, room.stands)
    xs = GRID.xs[None, :] * np.ones(GRID.shape)
    before, after = (float((r.drives * xs).sum() / r.drives.sum()) for r in (room, moved))
    assert after < before - 0.3  # it can only have gone inwards


def test_the_spread_of_one_that_drives_grows_by_the_variance_given() -> None:
    room = lost_at(GRID, (0.0, 0.0), 1e-4 * np.eye(2))
    nowhere, peak = np.zeros(GRID.shape), np.where(room.goes_on == room.goes_on.max(), 0.25, 0.0)
    start = RoomMap(GRID, nowhere, peak, nowhere, nowhere, room.overlooked)
    moved = start
    for _ in range(10):
        moved = moved.moved(0.018)
    ys = GRID.ys[:, None]
    grown = ((moved.drives * ys**2).sum() - (start.drives * ys**2).sum()) / start.drives.sum()
    assert grown == pytest.approx(0.18, rel=1e-6)


def test_empty_pictures_move_the_probability_elsewhere_and_count_as_searched() -> None:
    room = unknown_place(GRID)
    assert room.excluded(EVERYWHERE) == 0.0
    for _ in range(6):
        room = room.emptied(seen_within(0.0, 0.0, 2.0))
    share = np.mean(seen_within(0.0, 0.0, 2.0) > 0)
    assert room.excluded(EVERYWHERE) == pytest.approx(share, rel=1e-3)
    assert room.chances.sum() == pytest.approx(1.0)
    assert np.hypot(*room.likeliest(EVERYWHERE)) > 2.0


def test_when_every_place_is_excluded_it_may_be_anywhere_again() -> None:
    room = lost_at(GRID, (0.0, 0.0), 0.01 * np.eye(2)).uncovered(100.0 * HIDDEN_S)
    assert np.array_equal(room.emptied(np.ones(GRID.shape)).chances, unknown_place(GRID).chances)


def left_at_the_prediction(after_s: float) -> float:
    """Return the probability near a target's predicted place after pictures of all around there, 6 a second."""
    room, around = lost_at(GRID, (0.0, 0.0), 0.01 * np.eye(2)), seen_within(0.0, 0.0, 1.0)
    for _ in range(round(after_s * 6)):
        room = room.uncovered(1.0 / 6.0).emptied(around)
    assert room.chances.sum() == pytest.approx(1.0)
    return room.mass_near((0.0, 0.0), 0.01 * np.eye(2), 2.0, 0.5)


def test_the_chance_that_an_unseen_target_is_hidden_decays_with_time() -> None:
    given_up_below = 0.3  # control/search_parameters.py
    assert left_at_the_prediction(1.0) > given_up_below
    assert left_at_the_prediction(2.0) < given_up_below
    assert left_at_the_prediction(4.0) < 0.15


def test_hidden_target_probability_is_split_into_standing_and_moving() -> None:
    room = lost_at(GRID, (0.0, 0.0), 0.01 * np.eye(2))
    later = room.uncovered(HIDDEN_S)
    assert later.hidden.sum() == pytest.approx(room.hidden.sum() / np.e)
    assert later.chances == pytest.approx(room.chances)
    assert np.array_equal(later.drives, room.drives)
    shown = (1.0 - 1.0 / np.e) * room.hidden.sum()
    assert later.stands.sum() - room.stands.sum() == pytest.approx(0.3 * shown)
    assert later.goes_on.sum() - room.goes_on.sum() == pytest.approx(0.7 * shown)


@pytest.mark.parametrize("place", [(900.0, 0.0), (-1e5, 3e4), (4.5, -3.5)])
def test_a_target_that_was_predicted_beyond_the_walls_is_looked_for_in_the_room(place: tuple[float, float]) -> None:
    """An estimate that ran off, or a decoy: no probability may become none at all."""
    room = lost_at(GRID, place, 0.04 * np.eye(2))
    assert np.isfinite(room.chances).all() and room.chances.sum() == pytest.approx(1.0)
    row, column = np.unravel_index(int(room.chances.argmax()), GRID.shape)
    near = np.argmin(np.hypot(GRID.xs[None, :] - place[0], GRID.ys[:, None] - place[1]))
    assert (row, column) == np.unravel_index(int(near), GRID.shape)


@pytest.mark.parametrize("size_m", [(8.0, 6.0), (40.0, 25.0), (60.0, 40.0), (100.0, 60.0)])
@pytest.mark.parametrize("at_once", [False, True])
def test_a_place_holds_its_target_in_a_hall_of_large_cells_too(size_m: tuple[float, float], at_once: bool) -> None:
    """Nobody has looked there yet: with cells of 1 m, half of the places were given up at once."""
    grid = RoomGrid.over(*size_m)
    for share in np.random.default_rng(2).uniform(-0.5, 0.5, (40, 2)):
        place, covariance = share * size_m, 0.1**2 * np.eye(2)
        assert lost_at(grid, place, covariance, at_once).mass_near(place, covariance, 2.0, 0.5) > 0.4


@pytest.mark.parametrize(("x_m", "holds"), [(3.9, True), (4.3, True), (4.6, True), (4.9, True), (6.0, False)])
def test_a_target_at_the_wall_may_be_estimated_a_little_beyond_it(x_m: float, holds: bool) -> None:
    """One that is estimated far outside is not there."""
    room = lost_at(GRID, (x_m, 1.0), 0.05**2 * np.eye(2))
    assert (room.mass_near((x_m, 1.0), 0.05**2 * np.eye(2), 2.0, 0.5) > 0.5) is holds


@pytest.mark.parametrize("speed_m_s", [0.0, 0.22, 0.45])
def test_one_that_drives_on_as_it_did_is_not_given_up_by_time_alone(speed_m_s: float) -> None:
    room, cells = lost_at(GRID, (-1.0, 0.0), 0.01 * np.eye(2)), 0
    for step in range(24):
        way_m = speed_m_s * 0.1 * (step + 1)
        room = room.predicted(0, round(way_m / GRID.cell_m) - cells, 0.002).moved(0.018).uncovered(0.1)
        cells = round(way_m / GRID.cell_m)
    assert room.chances.sum() == pytest.approx(1.0)
    assert room.mass_near((way_m - 1.0, 0.0), 0.05 * np.eye(2), 2.0, 0.5) > 0.35


def test_a_target_no_longer_predicted_moves_about_its_last_place() -> None:
    room = lost_at(GRID, (1.0, 0.0), 0.01 * np.eye(2))
    about = room.given_up()
    assert about.chances == pytest.approx(room.chances)
    assert about.predicted(0, 5, 0.0).drives == pytest.approx(about.drives)


def test_a_prediction_that_goes_through_a_wall_stays_in_the_room() -> None:
    room = lost_at(GRID, (3.5, -2.5), 0.01 * np.eye(2))
    beyond = room.predicted(-200, 200, 0.0)
    assert beyond.chances.sum() == pytest.approx(1.0)
    assert int(beyond.goes_on.argmax()) == GRID.shape[1] - 1, "in the corner"

"""Pictures without new content: equal ones, and a frozen camera behind an encoder that continues."""

import math

import numpy as np
import pytest

from drivers.camera.unchanged import SteadyMarkers, UnchangedPictures

PICTURE_NS = 66_666_667
FOCAL_PX = 560.0
BOARD = np.array([[300.0, 200.0], [320.0, 200.0], [320.0, 214.0], [300.0, 214.0]])


def ages_of(shown):
    pictures = UnchangedPictures()
    levels = [np.full((40, 6), level, np.uint8) for level in shown]
    return [at - pictures.since_ns(picture, at) for at, picture in enumerate(levels)]


def test_equal_pictures_in_a_row_are_as_old_as_the_first():
    assert ages_of([7, 7, 7, 1, 2]) == [0, 1, 2, 0, 0]


@pytest.mark.parametrize("length", [2, 4, 8])
def test_pictures_that_are_repeated_in_turn_are_as_old_as_the_last_new_one(length):
    assert ages_of([k % length for k in range(40)]) == [0] * length + [*range(1, 41 - length)]


def test_a_new_picture_ends_a_repetition():
    assert ages_of([1, 2, 1, 2, *range(10, 20), 1]) == [0, 0, 1, 2] + [0] * 11


def test_pictures_that_differ_in_one_pixel_are_different():
    grey, other = np.zeros((40, 6), np.uint8), np.zeros((40, 6), np.uint8)
    other[5, 3] = 1
    pictures = UnchangedPictures()
    assert [pictures.since_ns(picture, at) for at, picture in enumerate((grey, other, other))] == [0, 1, 1]


def fly(shift_px, swing_deg, seconds=3.0, aloft=True):
    """Return the reported excess age of each picture [s]; shift_px: of the marker, by time [s]."""
    rng, steady, ages = np.random.default_rng(3), SteadyMarkers(FOCAL_PX), []
    for k in range(round(seconds * 15)):
        at_s, now_ns = k / 15, 10**12 + k * PICTURE_NS
        tilt = (math.radians(swing_deg / 2) * math.sin(2 * math.pi * at_s / 1.5), 0.0)
        corners = {"bot": BOARD + shift_px(at_s) + rng.normal(0.0, 0.1, BOARD.shape)}
        ages.append((now_ns - steady.since_ns(now_ns, corners, tilt if aloft else None)) * 1e-9)
    return ages


@pytest.mark.parametrize("swing_deg", [2.0, 5.0, 20.0])
def test_a_marker_that_stands_while_its_camera_tilts_shows_that_the_picture_hangs(swing_deg):
    ages = fly(lambda _: 0.0, swing_deg)
    first = next(k for k, age in enumerate(ages) if age > 0.0)
    assert first / 15 <= 1.0 and ages[first:] == pytest.approx([k / 15 for k in range(first, len(ages))], abs=0.01)


@pytest.mark.parametrize(
    "live",
    [
        {"shift_px": lambda at_s: 1.2 * at_s * 15, "swing_deg": 5.0},  # it moves
        {"shift_px": lambda at_s: 12.0 * math.sin(4.2 * at_s), "swing_deg": 2.5},  # as the tilt predicts
        {"shift_px": lambda _: 0.0, "swing_deg": 0.3},  # hardly any tilt: no decision is possible
        {"shift_px": lambda _: 0.0, "swing_deg": 5.0, "aloft": False},  # a standing drone may shake its sensors
    ],
)
def test_a_living_picture_is_its_own_age(live):
    assert max(fly(**live)) == 0.0


def test_a_picture_that_moves_again_is_new_at_once():
    ages = fly(lambda at_s: 40.0 * (at_s >= 2.0) + 30.0 * max(0.0, at_s - 2.0), 5.0)
    assert ages[29] > 1.0 and max(ages[30:]) == 0.0


def test_a_picture_without_markers_tells_nothing():
    steady, seen = SteadyMarkers(FOCAL_PX), [{"bot": BOARD}] * 14 + [{}] + [{"bot": BOARD}] * 3 + [{"bot": BOARD + 2.0}]
    ages = []
    for k, corners in enumerate(seen):
        tilt = (math.radians(3.0) * (k % 2), 0.0)
        ages.append(k - steady.since_ns(k * PICTURE_NS, corners, tilt) / PICTURE_NS)
    assert ages == [0] * 12 + [12, 13, 0, 15, 16, 17, 0]

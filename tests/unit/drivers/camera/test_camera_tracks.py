"""Identities of boards that are followed: none moves to the next board, and motion costs at most one reading."""

import cv2
import numpy as np
import pytest

from drivers.camera import pose
from drivers.camera.detect import Find
from drivers.camera.markers import BarReading
from drivers.camera.pipeline import Pipeline
from drivers.camera.prediction import Prediction
from drivers.camera.settings import DetectorSettings, MarkerSettings
from drivers.camera.tracks import Track
from groundstation.geometry import board as marker
from groundstation.geometry.lens import CameraIntrinsics

FRAME_NS = 66_666_667


def boards_at(boards, square_px, random):
    """Return a poor picture (far, noisy) of boards by code with their left upper corners [px]."""
    picture = np.full((360 * 4, 640 * 4), 120, np.uint8)
    for code, (x, y) in boards.items():
        raster = np.asarray(marker.raster(code, 4.0 * square_px)[0])
        left, top = int(4 * x), int(4 * y)
        picture[top : top + raster.shape[0], left : left + raster.shape[1]] = raster
    small = cv2.GaussianBlur(cv2.resize(picture, (640, 360), interpolation=cv2.INTER_AREA), (0, 0), 1.0)
    return np.clip(small + random.normal(0.0, 5.0, small.shape), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_an_identity_does_not_move_to_the_next_board_when_its_own_is_hidden(seed):
    """Two boards are a card apart, far away and badly lit; the first is covered after a second."""
    square_px, random, codes = 3.8, np.random.default_rng(seed), {"bot": 3, "drone_2": 12}
    markers = tuple(MarkerSettings(entity=e, code=c, square_mm=44.0) for e, c in codes.items())
    lens = CameraIntrinsics(640, 360, 460.0, 460.0, 320.0, 180.0)
    pipeline = Pipeline(lens, markers, DetectorSettings(), search_rate_hz=2.0)
    places = {12: np.array([280.3 + 6.6 * square_px + 2.0, 150.2]), 3: np.array([280.3, 150.2])}
    middle, size = np.array([2.8, 2.4]) * square_px, (1.8 * square_px, square_px, 6.0)
    expected = {entity: Prediction(places[code] + middle, *size) for entity, code in codes.items()}
    facing = pose.Gravity(np.diag([1.0, -1.0, -1.0]), 0.0, 0.0, known=True)
    seen = []
    for k in range(45):
        shown = {code: place for code, place in places.items() if code == 12 or k < 15}
        picture = boards_at(shown, square_px, random)
        out = pipeline.process(picture, k * FRAME_NS, lambda _: facing, expected)
        seen.append({sighting.entity for sighting in out})
    assert "bot" in set().union(*seen[:15])
    assert "bot" not in set().union(*seen[15:])


def follows(off_squares, code=5, pending=None):
    """Return a track of a board with squares of 10 px, after a find that many squares from where it should be."""
    corners = 100.0 + 10.0 * marker.corner_grid()
    track = Track(corners, 0, code=code, pending=pending, margin=2.5)
    track.follow(Find(corners + np.array([10.0 * off_squares, 0.0]), 200.0, 50.0), FRAME_NS)
    return track


def test_a_board_that_is_not_where_it_should_be_is_read_again():
    assert follows(1.9).code == 5
    assert follows(2.1).code is None


@pytest.mark.parametrize(("reading", "code"), [(BarReading(5, 1.1), 5), (BarReading(5, 0.9), None), (None, None)])
def test_one_sure_reading_of_the_former_code_is_enough(reading, code):
    track = follows(2.1)
    track.identify(reading, FRAME_NS, 1.0)
    assert track.code == code


def test_another_code_must_be_read_as_any_new_one():
    track = follows(2.1)
    track.identify(BarReading(2, 1.5), FRAME_NS, 1.0)
    assert track.code is None
    track.identify(BarReading(2, 1.5), 2 * FRAME_NS, 1.0)
    assert track.code == 2


def test_a_reading_that_waits_for_its_second_one_outlasts_motion():
    assert follows(2.1, code=None, pending=5).pending == 5

"""The smooth unoccluded share of a marker agrees with hard geometry, and its derivatives with differences."""

import numpy as np
import pytest

from groundstation.arrays import Array
from groundstation.sensing.models import Box
from groundstation.sensing.occlusion import box_rows, sight

PILLAR, TABLE = Box((0.3, -0.2), (0.5, 0.4, 1.7)), Box((-0.8, 0.6), (1.2, 0.7, 0.8))
BOXES = box_rows([PILLAR, TABLE])


def share(eye: Array, point: Array, width: float = 0.05) -> float:
    return float(sight(BOXES, width, *eye.tolist(), *point.tolist()).a)


def ways(count: int, seed: int) -> list[tuple[Array, Array]]:
    """Return eyes and points about the boxes, like cameras and markers: eyes above."""
    rng = np.random.default_rng(seed)
    low, high, up = np.array([-2.0, -2.0, 0.1]), np.array([2.0, 2.0, 1.2]), np.array([0.0, 0.0, 1.0])
    return [(rng.uniform(low, high) + up, rng.uniform(low, high)) for _ in range(count)]


def is_hidden(eye: Array, point: Array) -> bool:
    """Return whether any of many points on the line is inside a box."""
    on_way = eye + np.linspace(0.0, 1.0, 2000)[:, None] * (point - eye)
    return any(
        bool((np.abs(on_way - np.array(box.middle_m)) < np.array(box.size_m) / 2).all(axis=1).any())
        for box in (PILLAR, TABLE)
    )


def test_a_sharp_edge_hides_what_boxes_are_in_between() -> None:
    found = [(is_hidden(*way), share(*way, width=1e-4)) for way in ways(1500, 1)]
    assert sum(hidden for hidden, _ in found) > 200
    wrong = sum((free < 0.5) is not hidden for hidden, free in found)
    assert wrong <= 2  # lines that graze an edge within the sampling step


def test_the_slopes_are_those_of_differences() -> None:
    steep = 0
    for eye, point in ways(300, 2):
        seen = sight(BOXES, 0.05, *eye.tolist(), *point.tolist())
        slopes = np.array([seen.eye_x, seen.eye_y, seen.eye_z, seen.x, seen.y, seen.z])
        steep += bool(np.abs(slopes).max() > 0.1)
        for k in range(6):
            step = np.zeros(6)
            step[k] = 1e-6
            more, less = (share(eye + s * step[:3], point + s * step[3:]) for s in (1.0, -1.0))
            assert slopes[k] == pytest.approx((more - less) / 2e-6, abs=1e-5)
    assert steep > 30


def test_the_visible_share_grows_as_a_marker_leaves_an_occlusion() -> None:
    eye = np.array([0.3, -2.0, 1.2])
    shares = [share(eye, np.array([x, 1.0, 0.4])) for x in np.linspace(0.3, 2.0, 60)]
    assert shares[0] < 0.05
    assert shares[-1] > 0.99
    assert (np.diff(shares) > -1e-9).all()


def test_a_room_without_boxes_hides_nothing() -> None:
    seen = sight(box_rows([]), 0.05, 0.0, 0.0, 2.0, 1.0, 0.0, 0.4)
    assert seen == (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

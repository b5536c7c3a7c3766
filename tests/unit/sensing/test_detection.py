"""The probability that a searched picture shows a marker follows the one model of camera visibility."""

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.sensing.detection import FOUND_SHARE, detection, detection_map
from groundstation.sensing.footprint import HEADINGS, footprint_of, seen_from, swept
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.visibility import camera_rows
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

SENSORS = sensors_from_field(resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml")))
ONBOARD, CEILING = SENSORS.onboard["drone_1"], SENSORS.world["ceiling"]


def test_a_marker_well_in_view_is_mostly_found_and_one_out_of_view_hardly_ever() -> None:
    camera, rng = camera_rows([ONBOARD], SENSORS.softness)[0], np.random.default_rng(1)
    inside = outside = 0
    for _ in range(4000):
        pose = np.array([*rng.uniform(-1, 1, 2), 1.6, rng.uniform(-3, 3)])
        marker = np.array([*(pose[:2] + rng.uniform(-2, 2, 2)), 0.4])
        margin = ONBOARD.view.margin(ONBOARD.optical(pose, marker))
        chance = detection(camera, pose, 0.0, *marker)
        if margin > 0.2:
            inside += 1
            assert chance > 0.9 * FOUND_SHARE
        elif margin < -0.4:
            outside += 1
            assert chance < 0.01
    assert inside > 20
    assert outside > 1000


def test_a_pose_that_is_not_sure_counts_less_of_the_edge() -> None:
    camera, pose = camera_rows([ONBOARD], SENSORS.softness)[0], np.array([0.0, 0.0, 1.6, 0.0])
    sure, unsure = (detection(camera, pose, slack, 0.75, 0.0, 0.4) for slack in (0.0, 0.3))
    assert sure > 3.0 * unsure


def test_a_fixed_camera_looks_from_its_own_place() -> None:
    camera = camera_rows([CEILING], SENSORS.softness)[0]
    assert detection(camera, np.zeros(4), 0.0, 0.5, 0.2, 1.6) == pytest.approx(FOUND_SHARE, abs=0.01)
    assert detection(camera, np.zeros(4), 0.0, 3.0, 0.0, 1.6) < 1e-3


def test_a_footprint_turns_with_the_heading_and_agrees_with_the_map() -> None:
    print_, xs = footprint_of(ONBOARD, 0.2, 1.6, 0.4, SENSORS.softness), (np.arange(41, dtype=np.float64) - 20) * 0.2
    camera = camera_rows([ONBOARD], SENSORS.softness)[0]
    chances = np.full((41, 41), 1.0)
    at = np.array([20], dtype=np.int64)
    seen = seen_from(chances, at, at, print_.rows, print_.columns, print_.chances, print_.first)
    assert seen.shape == (1, HEADINGS)
    for heading in range(HEADINGS):
        pose = np.array([0.0, 0.0, 1.6, math.tau * heading / HEADINGS])
        there = detection_map(camera, pose, 0.0, xs, xs, 0.4)
        assert seen[0, heading] == pytest.approx(there.sum(), rel=0.05)
        row, column = (int(v) for v in np.argwhere(there == there.max())[0])
        assert math.hypot(xs[column], xs[row]) > 0.5
        assert math.cos(math.atan2(xs[row], xs[column]) - pose[3]) > 0.8


def test_cells_seen_in_one_view_count_as_seen_in_the_next() -> None:
    print_, chances = footprint_of(ONBOARD, 0.2, 1.45, 0.4, SENSORS.softness), np.full((41, 41), 1.0)
    before, cells = chances.copy(), (np.stack((print_.rows, print_.columns)), print_.chances, print_.first)
    at, turns = np.full((1, 2), 20, dtype=np.int64), np.array([[3, 3], [3, 4], [3, 9]], dtype=np.int64)
    value, found = swept(chances, at, at, turns, np.array([1.0, 0.5]), *cells)
    once = print_.chances[print_.first[3] : print_.first[4]]
    assert found[0, 0] == pytest.approx(once.sum() + (once * (1.0 - once)).sum())
    assert value[0, 0] == pytest.approx(once.sum() + 0.5 * (once * (1.0 - once)).sum())
    assert found[0, 0] < found[0, 1] < found[0, 2], "the same again, the one beside it, the opposite one"
    assert (chances == before).all()


def test_the_largest_marker_must_be_in_the_picture_and_the_smallest_be_read() -> None:
    """A place must be half the diagonal of a board, 3.5 squares, within the picture."""
    options = ["defaults.marker.square_mm=30", "target.marker.square_mm=80"]
    suite = sensors_from_field(resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml", options)))
    assert suite.onboard["drone_1"].view.border_m == pytest.approx(3.5 * 0.080)
    ceiling = suite.world["ceiling"].view
    assert ceiling.border_m == pytest.approx(3.5 * 0.030), "it observes drones only"
    assert ceiling.range_m == pytest.approx(1179.0 * 0.030 / 10.0, rel=0.01)
    both = sensors_from_field(
        resolved_field(
            load_field(
                Path(__file__).parents[3] / "config/lab.yaml", [*options, "cameras.ceiling.observes=[robots, targets]"]
            )
        )
    )
    assert both.world["ceiling"].view.border_m == pytest.approx(3.5 * 0.080)

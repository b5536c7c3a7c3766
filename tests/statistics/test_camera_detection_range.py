"""Required detector performance (640x360, f 460 px): range, errors, covariance consistency, identities, flips."""

import numpy as np
import pytest

from groundstation.geometry.board import VALID_CODES
from sim_bridge.study.vision.measure import measured
from sim_bridge.study.vision.scenes import CONDITIONS, shots

pytestmark = [pytest.mark.slow, pytest.mark.statistics]
CLEAN, REAL = CONDITIONS[:2]


@pytest.mark.parametrize("range_m", [1.0, 2.0, 3.0, 4.0])
def test_found_where_expected(range_m):
    tally = measured(shots(80, range_m, CLEAN, 5), 5, searching=False)
    assert tally.followed >= 0.95 * 80


@pytest.mark.parametrize("range_m", [1.0, 2.5])
def test_found_by_searching_and_where_a_cold_belief_has_it(range_m):
    tally = measured(shots(50, range_m, CLEAN, 6), 6)
    assert tally.searched >= 0.85 * 50
    assert tally.acquired >= 0.85 * 50


@pytest.mark.parametrize(("range_m", "range_mm"), [(2.0, 1.5), (3.0, 5.0)])
def test_errors_in_clean_pictures(range_m, range_mm):
    tally = measured(shots(100, range_m, CLEAN, 7), 7, searching=False)
    assert np.median(tally.range_mm) <= range_mm
    if range_m == 2.0:
        assert np.median(tally.heading_deg) <= 0.2


@pytest.mark.parametrize("condition", [CLEAN, REAL], ids=lambda condition: condition.name)
def test_covariances_are_honest(condition):
    tallies = [measured(shots(60, range_m, condition, 8), 8, searching=False) for range_m in (1.0, 2.0, 3.0)]
    for nees in ([t.nees_6 for t in tallies], [t.nees_4 for t in tallies]):
        assert 0.6 <= np.mean(np.concatenate(nees)) <= 1.5


def test_no_identity_is_wrong_and_no_pose_is_flipped():
    """500 readings of all codes at 1-4 m with 0.2 px of corner noise; 125 poses each, gravity known to 2 deg."""
    tallies = [measured(shots(125, range_m, REAL, 9, VALID_CODES), 9, searching=False) for range_m in (1, 2, 3, 4)]
    assert sum(tally.pictures for tally in tallies) == 500
    assert sum(tally.wrong_ids for tally in tallies) == 0
    assert sum(tally.flips for tally in tallies) == 0
    assert sum(tally.sure for tally in tallies) >= 0.9 * 500

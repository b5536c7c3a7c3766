"""The offset between two records of one turning: also of a camera far later than its setting."""

import numpy as np
import pytest

from groundstation.calibration.time_offset import FAR_S, NEAR_S, Part, across, interpolated, shift_between


def turning(later_s: float, seed: int = 1) -> Part:
    """Return a camera's headings of a turning drone, stamped too late by so much, and the drone's own."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 120.0, 0.02)
    rate = np.convolve(rng.normal(0.0, 1.0, len(times) + 50), np.ones(51) / 51, "valid")
    heading = np.cumsum(4.0 * rate) * 0.02
    seen_s = np.sort(rng.uniform(1.0, 118.0, 1500))
    seen = np.interp(seen_s, times, heading) + rng.normal(0.0, 0.008, 1500)
    stamps = seen_s + later_s
    return Part(stamps, seen[:, None], interpolated(times, heading[:, None]), across(stamps))


@pytest.mark.parametrize("later_s", [-0.11, 0.0, 0.1, 0.18, 0.28])
def test_a_camera_is_found_wherever_networks_put_it(later_s: float) -> None:
    found = shift_between([turning(later_s)], False, FAR_S)
    assert found is not None and found[0] == pytest.approx(-later_s, abs=4.0 * found[1]) and found[1] < 0.02


def test_beyond_the_range_there_is_none() -> None:
    assert shift_between([turning(0.28)], False, NEAR_S) is None

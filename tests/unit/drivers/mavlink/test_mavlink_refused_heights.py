"""An estimator that refuses the heights that it is fed: told while it says so, and no longer."""

import math

import pytest

from drivers.mavlink.uncertainty import StatedUncertainty
from drivers.mavlink.wire.telemetry import EkfStatusReport

S = 1_000_000_000


@pytest.fixture
def stated():
    return StatedUncertainty()


def say(stated, at_s, ratio, seconds=1.0):
    for turn in range(round(seconds * 10)):
        report = EkfStatusReport(
            flags=0, velocity_variance=0.1, pos_horiz_variance=0.1, pos_vert_variance=ratio, compass_variance=0.0,
            terrain_alt_variance=0.0,
        )  # fmt: skip
        stated.take(round((at_s + turn / 10) * S), report)


def test_it_is_told_after_half_a_second_and_as_long_as_it_is_said(stated):
    say(stated, 10.0, 2.0, 0.4)
    assert stated.doubts(round(10.4 * S)) == ""
    say(stated, 10.4, 2.0, 0.4)
    assert "refuses the heights" in stated.doubts(round(10.8 * S))
    say(stated, 10.8, 0.2, 0.1)
    assert stated.doubts(round(10.9 * S)) == ""


def test_one_that_compares_nothing_any_more_is_told_no_longer(stated):
    say(stated, 10.0, 2.0)
    say(stated, 11.0, math.nan, 5.0)
    assert stated.doubts(16 * S) == "" and stated.climb_std_m_s(16 * S) == 0.0


def test_the_next_flight_begins_without_it(stated):
    say(stated, 10.0, 2.0)
    stated.leave_floor(11 * S)
    say(stated, 11.1, 2.0, 0.3)
    assert stated.doubts(round(11.4 * S)) == ""

"""Standard deviations of an autopilot's velocity and attitude: its own report, its test ratios, and its drift."""

import math

import pytest

from drivers.mavlink.uncertainty import StatedUncertainty
from drivers.mavlink.wire.flight import OdometryMessage
from drivers.mavlink.wire.names import EkfFlag
from drivers.mavlink.wire.telemetry import EkfStatusReport, EstimatorStatus

S = 1_000_000_000
# WIRE (PX4 1.16): as standing on the floor with positions from outside, no origin set; and after they end.
AIDED, UNAIDED = 0x1AF, 0xA5


def estimator(velocity, position, flags=AIDED):
    return EstimatorStatus(0, flags, velocity, position, 0, 0, 0, 0, 0, 0)


def odometry(velocity, tilt):
    pose, motion = [0.0] * 21, [0.0] * 21
    pose[15] = pose[18] = tilt
    motion[0] = motion[6] = velocity
    return OdometryMessage(1, 1, 1, 0, 0, 0, (1, 0, 0, 0), 0, 0, 0, 0, 0, 0, tuple(pose), tuple(motion))


def test_stated_uncertainty_is_valid_for_three_seconds():
    stated = StatedUncertainty()
    stated.take(S, odometry(0.04, 4e-4))
    assert stated.velocity_std_m_s(2 * S) == pytest.approx(0.2)
    assert stated.attitude_std_rad(2 * S) == pytest.approx(0.02)
    assert stated.velocity_std_m_s(5 * S) == stated.attitude_std_rad(5 * S) == 0.0


@pytest.mark.parametrize("unknown", [math.nan, 0.0, -1.0, 1e4, math.inf])
def test_an_unknown_covariance_states_nothing(unknown):
    stated = StatedUncertainty()
    stated.take(S, odometry(unknown, unknown))
    assert stated.velocity_std_m_s(S) == stated.attitude_std_rad(S) == 0.0


def test_a_large_doubt_is_one_and_not_none():
    stated = StatedUncertainty()
    stated.take(S, odometry(9.0, 9.0))
    assert stated.velocity_std_m_s(S) == pytest.approx(2.0)
    assert math.degrees(stated.attitude_std_rad(S)) == pytest.approx(10.0)


@pytest.mark.parametrize(("ratio", "std"), [(0.3, 0.0), (0.5, 0.0), (0.75, 0.25), (1.0, 0.5), (44.0, 0.5)])
def test_a_filter_that_refuses_what_it_is_fed_is_doubted(ratio, std):
    px4, ardupilot = StatedUncertainty(), StatedUncertainty()
    px4.take(S, estimator(0.1, ratio))
    ardupilot.take(S, EkfStatusReport(0, 0.1, ratio, 0, 0, 0))
    assert px4.velocity_std_m_s(S) == ardupilot.velocity_std_m_s(S) == pytest.approx(std)


@pytest.mark.parametrize("before", [0.1, 1.4])
def test_a_px4_that_takes_no_more_positions_is_doubted(before):
    """PX4 then sends NaN for its ratios, and takes back its flags for velocity and position."""
    stated = StatedUncertainty()
    stated.take(S, estimator(math.nan, before))
    stated.take(2 * S, estimator(math.nan, math.nan, UNAIDED))
    assert stated.velocity_std_m_s(2 * S) == 0.5
    stated.take(3 * S, estimator(math.nan, 0.1))
    assert stated.velocity_std_m_s(3 * S) == 0.0


def test_a_position_that_is_neither_valid_nor_compared_is_doubted():
    stated = StatedUncertainty()
    stated.take(S, estimator(0.1, math.nan, UNAIDED | EkfFlag.VELOCITY_HORIZ))
    assert stated.velocity_std_m_s(S) == 0.5


@pytest.mark.parametrize("position", [0.1, math.nan])
def test_a_px4_that_compares_no_velocity_is_not_doubted_for_that(position):
    """vel_ratio is always NaN where no velocity is fed, and both are from 0.4 s after the last position on."""
    stated = StatedUncertainty()
    stated.take(S, estimator(math.nan, position))
    assert stated.velocity_std_m_s(S) == 0.0


def test_a_doubt_outlasts_a_message_without_ratios():
    stated = StatedUncertainty()
    stated.take(S, estimator(math.nan, 1.4))
    stated.take(2 * S, estimator(math.nan, math.nan))
    assert stated.velocity_std_m_s(4 * S) == 0.5
    assert stated.velocity_std_m_s(5 * S) == 0.0


def test_a_velocity_that_drifts_says_how_far_its_attitude_is_off():
    stated = StatedUncertainty()
    stated.see_drift(S, 0.03)
    assert stated.attitude_std_rad(S) == 0.0
    stated.see_drift(2 * S, 0.5)
    stated.see_drift(3 * S, 0.0)
    assert math.degrees(stated.attitude_std_rad(3 * S)) == pytest.approx(1.9, abs=0.2)
    stated.see_drift(63 * S, 0.0)
    assert math.degrees(stated.attitude_std_rad(63 * S)) < 0.1


def test_its_velocity_is_doubted_while_it_lifts_off_and_for_three_seconds_after():
    stated = StatedUncertainty()
    assert stated.velocity_std_m_s(S) == 0.0
    stated.leave_floor(5 * S)
    assert stated.velocity_std_m_s(8 * S) == 0.5
    assert stated.velocity_std_m_s(8 * S + 1) == 0.0


def reports_of_heights(ratio):
    return EkfStatusReport(0, 0.1, 0.1, ratio, 0, 0), EstimatorStatus(0, AIDED, 0.1, 0.1, ratio, 0, 0, 0, 0, 0)


@pytest.mark.parametrize("flavour", [0, 1])
def test_a_filter_that_refuses_the_heights_it_is_fed_is_doubted_in_its_climb_only(flavour):
    stated = StatedUncertainty()
    for at_s, ratio, std in ((1, 0.3, 0.0), (2, 0.75, 0.25), (3, 4.96, 0.5), (4, math.nan, 0.5), (5, 0.2, 0.0)):
        stated.take(at_s * S, reports_of_heights(ratio)[flavour])
        assert stated.climb_std_m_s(at_s * S) == pytest.approx(std)
        assert stated.velocity_std_m_s(at_s * S) == 0.0
    stated.take(6 * S, reports_of_heights(2.0)[flavour])
    assert stated.climb_std_m_s(9 * S) == 0.5 and stated.climb_std_m_s(9 * S + 1) == 0.0


def test_heights_refused_for_longer_than_a_moment_are_told_until_they_are_taken_again():
    stated = StatedUncertainty()
    told = []
    for turn, ratio in enumerate((0.9, 1.2, 1.0, 1.1, 1.5, math.nan, 2.0, 0.9)):
        now_ns = S + turn * S // 4
        stated.take(now_ns, reports_of_heights(ratio)[0])
        told.append(bool(stated.doubts(now_ns)))
    assert told == [False] * 5 + [True, True, False]

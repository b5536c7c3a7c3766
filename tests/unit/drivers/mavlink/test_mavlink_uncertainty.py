"""Standard deviations of an autopilot's velocity and attitude: its own report, its test ratios, and its drift."""

import math

import pytest

from drivers.mavlink.uncertainty import StatedUncertainty
from drivers.mavlink.wire.flight import OdometryMessage
from drivers.mavlink.wire.telemetry import EkfStatusReport, EstimatorStatus

S = 1_000_000_000


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
    px4.take(S, EstimatorStatus(0, 0, 0.1, ratio, 0, 0, 0, 0, 0, 0))
    ardupilot.take(S, EkfStatusReport(0, 0.1, ratio, 0, 0, 0))
    assert px4.velocity_std_m_s(S) == ardupilot.velocity_std_m_s(S) == pytest.approx(std)


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

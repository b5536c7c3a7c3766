"""Position hold of a vehicle whose estimator errs: during take-off, hover and flight."""

import math

import pytest

from groundstation.bus.topics import ODOMETRY


class Swaying:
    """A tilt error that changes sign, as the estimator learns a lasting one; its velocity is wrong by up to 0.5 m/s."""

    def __init__(self, degrees, period_s=10.0):
        self._error, self._period_s = math.radians(degrees), period_s
        self._s = 0.0

    def step(self):
        self._s += 0.005
        return self._error * math.sin(math.tau * self._s / self._period_s)


@pytest.fixture
def unlevel(rig):
    rig.copter.estimate._tilt = (Swaying(0.0), Swaying(2.5))
    return rig


def _watch(rig, seconds):
    """Return the largest error of its own velocity, and its greatest distance from its place."""
    x, y, worst, gone = rig.body.x, rig.body.y, 0.0, 0.0
    for _ in range(round(seconds / 0.005)):
        rig.tick()
        told, body = rig.copter.estimate.velocity, rig.body
        worst = max(worst, math.hypot(told[0] - body.vx, told[1] - body.vy))
        gone = max(gone, math.hypot(body.x - x, body.y - y))
    return worst, gone


def test_it_is_held_over_its_pad_through_take_off_and_after(unlevel):
    stood_m = unlevel.body.z
    unlevel.take_off()
    worst, gone = _watch(unlevel, 12.0)
    assert worst > 0.3, "its estimator is to err"
    assert gone < 0.25
    assert unlevel.body.z - stood_m == pytest.approx(0.8, rel=0.1), "above where it stood"
    assert math.hypot(unlevel.body.x - 0.5, unlevel.body.y + 0.3) < 0.25
    assert unlevel.mode == "HOVER"


def test_it_flies_the_velocity_that_is_asked_for(unlevel):
    unlevel.track_on()
    unlevel.wanted = ((0.4, 0.0, 0.0), 0.0)
    unlevel.run(2.0)
    x, y = unlevel.body.x, unlevel.body.y
    unlevel.run(10.0)
    c, s = math.cos(unlevel.body.yaw), math.sin(unlevel.body.yaw)
    x, y = (unlevel.body.x - x) / 10.0, (unlevel.body.y - y) / 10.0
    assert 0.3 < c * x + s * y < 0.45 and abs(c * y - s * x) < 0.05
    assert unlevel.mode == "TRACK"


def test_the_velocity_of_an_estimator_that_hardly_fits_its_poses_is_published_as_worse(rig):
    rig.take_off()
    rig.run(4.0)
    rig.messages(ODOMETRY)
    rig.run(2.0)
    least = rig.settings.vehicles[0].velocity_std_m_s
    assert max(o.velocity_covariance[0] for o in rig.messages(ODOMETRY)) == pytest.approx(least**2)
    rig.copter.estimate._tilt = (Swaying(0.0), Swaying(10.0, 20.0))
    rig.run(5.0)
    assert rig.copter.estimate.test_ratio > 0.6
    assert max(o.velocity_covariance[0] for o in rig.messages(ODOMETRY)) > (least + 0.05) ** 2


def test_its_velocity_is_published_as_worse_from_the_turn_of_its_motors_until_it_has_lifted_off(rig):
    def deviation():
        return max(o.velocity_covariance[0] for o in rig.messages(ODOMETRY)) ** 0.5

    rig.connect()
    rig.messages(ODOMETRY)
    rig.run(1.0)
    least = rig.settings.vehicles[0].velocity_std_m_s
    assert deviation() == pytest.approx(least)
    rig.take_off()
    assert deviation() == pytest.approx(0.5)
    rig.run(4.0)
    rig.messages(ODOMETRY)
    rig.run(1.0)
    assert deviation() == pytest.approx(least)

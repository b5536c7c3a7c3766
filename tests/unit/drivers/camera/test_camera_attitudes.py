"""What a camera knows of the time of an exposure: its carrier's attitude, interpolated, and the belief."""

import pytest

from drivers.camera.attitudes import AttitudeHistory
from drivers.camera.prediction import Foresight
from drivers.camera.settings import MarkerSettings, MountSettings
from groundstation.bus.messages import EntityEstimate, Estimate, Header
from groundstation.geometry.lens import CameraIntrinsics

MS = 1_000_000
LENS = CameraIntrinsics(1280, 720, 1179.0, 1179.0, 639.5, 359.5)
MARKER = MarkerSettings(entity="drone_1", code=1, square_mm=44.0)


def history(samples, span_ms=620):
    """Return a history with samples every 10 ms."""
    attitudes = AttitudeHistory(span_ms * MS)
    for k in range(samples):
        attitudes.add("drone_1", k * 10 * MS, 0.01 * k, -0.02 * k, now_ns=k * 10 * MS)
    return attitudes


def test_attitudes_are_read_at_the_exposure():
    attitudes = history(20)
    assert attitudes.at("drone_1", 55 * MS) == pytest.approx((0.055, -0.11))
    assert attitudes.at("drone_1", (190 + 150) * MS) == pytest.approx((0.19, -0.38))
    assert attitudes.at("drone_1", -150 * MS) == (0.0, 0.0)
    assert attitudes.at("drone_1", (190 + 250) * MS) is None
    assert attitudes.at("drone_2", 0) is None


def test_samples_are_kept_as_long_as_pictures_take_and_no_longer():
    assert history(300, span_ms=2500).at("drone_1", 990 * MS) == pytest.approx((0.99, -1.98))
    assert history(300).at("drone_1", 990 * MS) is None


def test_a_stamp_from_the_future_keeps_no_later_sample_out():
    attitudes = history(10)
    attitudes.add("drone_1", 5000 * MS, 1.0, 1.0, now_ns=100 * MS)
    attitudes.add("drone_1", 100 * MS, 0.1, -0.2, now_ns=100 * MS)
    assert attitudes.at("drone_1", 100 * MS) == (0.1, -0.2)
    assert attitudes.at("drone_1", 5000 * MS) is None


def test_estimates_are_kept_as_long_as_pictures_take():
    """Two seconds is the longest delay of video that a field may state."""
    foresight = Foresight(MountSettings(looking="down"), "ceiling", (MARKER,), LENS)
    for k in range(120):
        drone = EntityEstimate("drone_1", "robot", (0.0, 0.0, 1.0, 0.0), (0.0,) * 16, (0.0, 0.0, 0.0), True, 0.1)
        header = Header(k * 20 * MS, "c", "tracker", "tracker", k)
        foresight.add(Estimate(header=header, entities=(drone,), epoch=1))
    assert "drone_1" in foresight.at((119 * 20 - 2000) * MS, (0.0, 0.0))

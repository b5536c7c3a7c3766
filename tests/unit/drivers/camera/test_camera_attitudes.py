"""Attitudes of the camera's carrier, interpolated to the exposure."""

import pytest

from drivers.camera.attitudes import AttitudeHistory


def test_attitudes_are_read_at_the_exposure():
    history = AttitudeHistory()
    for k in range(20):
        history.add("drone_1", k * 10_000_000, 0.01 * k, -0.02 * k)
    assert history.at("drone_1", 55_000_000) == pytest.approx((0.055, -0.11))
    assert history.at("drone_1", 190_000_000 + 150_000_000) == pytest.approx((0.19, -0.38))
    assert history.at("drone_1", 190_000_000 + 250_000_000) is None
    assert history.at("drone_2", 0) is None

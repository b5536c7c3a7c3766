"""Availabilities of many edges in one loop equal those of single points; polynomials replace exp and log."""

import math

import numpy as np
import pytest

from groundstation.sensing.elementary import decay, log_of_sum
from groundstation.sensing.models import Frustum, OnboardCameraModel, Softness
from groundstation.sensing.visibility import available, available_at_once, camera_rows, limits_of

ONBOARD = OnboardCameraModel((0.09, 0.0, 0.02), Frustum.of_picture(640, 360, 460, 460, 1.9), pan_left_rad=0.1)


@pytest.mark.parametrize("count", [0, 1, 3, 4, 7, 8, 45])
def test_many_at_once_are_single_points_to_the_bit(count: int) -> None:
    """Also the last ones, which fill no vector: a plan must not depend on the order of its edges."""
    rng = np.random.default_rng(count)
    points, limits = rng.uniform(-2.5, 2.5, (3, count)), limits_of(camera_rows([ONBOARD], Softness())[0])
    doubts = np.array([rng.uniform(0.0, 0.05, count), rng.uniform(0.0, 0.01, count), rng.choice([0.0, 0.002], count)])
    views, found = np.vstack([np.tile(np.array(limits)[:, None], count), doubts]), np.empty((4, count))
    available_at_once(views, points, found)
    for e in range(count):
        assert found[:, e].tolist() == list(available(limits, *points[:, e], *doubts[:, e]))


def test_polynomials_are_exponential_and_logarithm() -> None:
    for exponent in np.linspace(-20.0, 0.0, 2001):
        assert decay(exponent) == pytest.approx(math.exp(exponent), rel=1e-12)
    for exponent in np.linspace(-39.9, -20.0, 200):
        assert decay(exponent) == pytest.approx(math.exp(exponent), rel=1e-8)
    assert decay(-40.1) == decay(-1e300) == decay(-math.inf) == 0.0
    for total in np.linspace(1.0, 6.0, 501):
        assert log_of_sum(total) == pytest.approx(math.log(total), abs=1e-10)

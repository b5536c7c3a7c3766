"""The heading by gyroscopes whose samples are far apart, or mostly lost."""

import math

import numpy as np

from groundstation.estimation.gyro_bias import GyroBias
from groundstation.estimation.inertial import InertialAttitude
from groundstation.geometry.angles import difference
from groundstation.geometry.stabilized_frame import STANDARD_GRAVITY_M_S2

START = 10**12


def heading_by_sparse_samples(rng: np.random.Generator) -> tuple[float, float]:
    """Return the error of the heading of a body that shakes, sampled at 10 Hz for 10 s [rad], and its stated walk."""
    attitude, rate, turned, force = InertialAttitude(), 0.0, 0.0, (0.0, 0.0, STANDARD_GRAVITY_M_S2)
    for ms in range(10_001):
        rate += -rate * 0.05 + 0.3 * math.sqrt(0.1) * rng.standard_normal()
        turned += rate / 1000 if ms > 0 else 0.0
        if ms % 100 == 0:
            attitude.take_imu(START + ms * 1_000_000, (0.0, 0.0, rate), force, standing=False)
    now = attitude.at(START + 10_000 * 1_000_000)
    assert now is not None
    return difference(now.yaw_rad, turned), now.yaw_std_rad


def test_a_heading_by_sparse_samples_is_stated_as_uncertain_as_it_is() -> None:
    """What a body turns between two samples, faster than it is sampled, is not seen: 100 runs."""
    rng, unlearnt = np.random.default_rng(11), GyroBias().yaw_std_rad
    errors, stated = zip(*(heading_by_sparse_samples(rng) for _ in range(100)), strict=True)
    walk = math.sqrt(float(np.mean(np.square(stated))) - unlearnt**2) * math.sqrt(10.0)
    assert 0.85 <= walk / float(np.sqrt(np.mean(np.square(errors)))) <= 1.25  # about 1.06 expected

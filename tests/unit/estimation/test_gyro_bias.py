"""The bias of gyroscopes that warm up on the ground, and in the view of a camera that is bumped."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from groundstation.estimation.gyro_bias import GyroBias

STEP_NS, START = 10_000_000, 10**12


class Stand:
    """A vehicle whose heading does not change; its gyroscope about the vertical has a bias [deg/s] by time [s]."""

    def __init__(self, bias_deg_s: Callable[[float], float]) -> None:
        self.learner, self._bias, self._now = GyroBias(), bias_deg_s, 0
        self._yaw, self._rng = 0.0, np.random.default_rng(1)

    def stand(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e9) // STEP_NS):
            self.learner.take_standing(START + self._now, (0.0, 0.0, self._go_on(8e-4)))

    def fly(self, seconds: float, seen_rad: float | None = None) -> None:
        """Fly; seen_rad: the heading by a fixed camera's pictures, at 14 Hz."""
        self.learner.leave_ground()
        for step in range(round(seconds * 1e9) // STEP_NS):
            self._yaw += (self._go_on(8e-3) - self.learner.rad_s[2]) * STEP_NS / 1e9
            self.learner.go_on(STEP_NS / 1e9, 4.0)
            if seen_rad is not None and step % 7 == 0:
                shown, std = seen_rad + math.radians(1.0) * self._rng.standard_normal(), math.radians(1.0)
                own_rad = math.remainder(self._yaw, math.tau)
                self.learner.take_sight("ceiling", START + self._now, shown, std**2, own_rad)

    def _go_on(self, noise: float) -> float:
        self._now += STEP_NS
        return math.radians(self._bias(self._now / 1e9)) + noise * float(self._rng.standard_normal())

    @property
    def error_deg_s(self) -> float:
        return abs(math.degrees(self.learner.rad_s[2]) - self._bias(self._now / 1e9))


@pytest.mark.parametrize("rise_deg_s", [0.5, 1.0])
def test_a_gyroscope_that_warms_up_is_followed_however_well_its_bias_was_known(rise_deg_s: float) -> None:
    vehicle = Stand(lambda at_s: rise_deg_s * (1.0 - math.exp(-at_s / 60.0)))
    for _ in range(4):
        vehicle.stand(30.0)
        assert vehicle.error_deg_s < 0.08


def test_a_bias_larger_than_expected_is_learnt_from_the_third_second_on() -> None:
    vehicle = Stand(lambda _: 2.5)
    vehicle.stand(2.5)
    assert vehicle.error_deg_s > 2.0
    vehicle.stand(1.0)
    assert vehicle.error_deg_s < 0.02


def test_two_odd_seconds_on_the_ground_teach_nothing() -> None:
    vehicle = Stand(lambda at_s: 1.0 if 10.0 < at_s < 12.0 else 0.2)
    vehicle.stand(15.0)
    assert vehicle.error_deg_s < 0.02


@pytest.mark.parametrize("turned_deg", [8.0, 40.0])
def test_a_bumped_camera_teaches_again_from_two_seconds_later(turned_deg: float) -> None:
    vehicle = Stand(lambda _: 0.3)
    vehicle.fly(1.0, seen_rad=0.0)
    vehicle.fly(2.5, seen_rad=math.radians(turned_deg))
    assert vehicle.error_deg_s < 1.0
    vehicle.fly(10.0, seen_rad=math.radians(turned_deg))
    assert vehicle.error_deg_s < 0.15

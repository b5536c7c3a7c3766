"""Anchors that hold their last range are found, and those of a robot that stands, in whatever steps, are not."""

import math
import random

import pytest

from drivers.ranging.anchor_watch import AnchorWatch

ANCHORS = {"a1": (-3.9, -2.9), "a2": (3.9, -2.9), "a3": (3.9, 2.9), "a4": (-3.9, 2.9), "a5": (0.0, -2.9)}


class Hall:
    """Rounds of one robot that stands or flies a circle, with noise and in steps [m]; 3 % of the ranges are missing."""

    def __init__(self, noise_m: float, step_m: float) -> None:
        self.watch, self.rng, self.ticks = AnchorWatch(), random.Random(1), 0
        self.noise_m, self.step_m, self.flies, self.held = noise_m, step_m, False, dict[str, float]()

    def round(self) -> dict[str, float]:
        self.ticks += self.flies
        angle = 0.04 * self.ticks
        told = {}
        for anchor, place in ANCHORS.items():
            m = math.dist((math.cos(angle), math.sin(angle)), place) + self.rng.gauss(0.0, self.noise_m)
            if self.rng.random() > 0.03:
                told[anchor] = self.held.get(anchor, self.step_m * round(m / self.step_m))
        return told

    def rounds_until_found(self, most: int = 2000) -> int:
        for number in range(most):
            sound = self.watch.sound("drone_1", self.round())
            if self.watch.stuck["drone_1"]:
                assert not set(self.watch.stuck["drone_1"]) & set(sound)
                return number
        return most


@pytest.mark.parametrize(("noise_m", "step_m"), [(0.08, 0.001), (0.02, 0.01), (0.005, 0.01), (0.0, 0.01), (0.02, 0.1)])
@pytest.mark.parametrize("flies", [False, True])
def test_nobody_loses_anchors_that_measure(noise_m: float, step_m: float, flies: bool) -> None:
    hall = Hall(noise_m, step_m)
    hall.flies = flies
    assert hall.rounds_until_found() == 2000
    hall.flies = not flies
    assert hall.rounds_until_found() == 2000, "also after it landed, or took off"


@pytest.mark.parametrize(("noise_m", "step_m", "within"), [(0.08, 0.001, 15), (0.02, 0.01, 25)])
def test_one_that_holds_its_range_is_named_the_sooner_the_finer_the_steps_are(
    noise_m: float, step_m: float, within: int
) -> None:
    hall = Hall(noise_m, step_m)
    hall.flies = True
    hall.rounds_until_found(200)
    hall.held = {"a3": 4.2}
    assert 9 <= hall.rounds_until_found() <= within and hall.watch.stuck["drone_1"] == ("a3",)
    hall.held = {}
    for _ in range(10):
        hall.watch.sound("drone_1", hall.round())
    assert not hall.watch.stuck["drone_1"], "it measures again"


def test_two_of_five_are_found_at_once() -> None:
    hall = Hall(0.08, 0.001)
    hall.rounds_until_found(50)
    hall.held = {"a1": 4.2, "a2": 3.3}
    assert hall.rounds_until_found() <= 40
    for _ in range(5):
        hall.watch.sound("drone_1", hall.round())
    assert hall.watch.stuck["drone_1"] == ("a1", "a2")


def test_robots_are_judged_apart() -> None:
    watch = AnchorWatch()
    for number in range(30):
        watch.sound("drone_1", {"a1": 1.0, "a2": 0.1 * number, "a3": 0.2 * number})
        watch.sound("drone_2", {"a1": 0.3 * number, "a2": 0.1 * number, "a3": 0.2 * number})
    assert watch.stuck == {"drone_1": ("a1",), "drone_2": ()}


def test_a_single_anchor_is_never_blamed() -> None:
    watch = AnchorWatch()
    for _ in range(100):
        assert watch.sound("drone_1", {"a1": 1.0}) == {"a1": 1.0}

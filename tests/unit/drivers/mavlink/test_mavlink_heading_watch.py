"""A heading that cameras contradict, and one that they do not know well enough to."""

import math

import pytest

from drivers.mavlink.heading_watch import HeadingWatch
from groundstation.bus.messages import EntityEstimate
from groundstation.time_units import NS_PER_MS


def estimate(std_deg: float = 1.0, age_s: float = 0.1, yaw_deg: float = 170.0) -> EntityEstimate:
    variances = [0.0] * 15 + [math.radians(std_deg) ** 2]
    mean = (0.0, 0.0, 1.0, math.radians(yaw_deg))
    return EntityEstimate("a", "robot", mean, tuple(variances), (0.0, 0.0, 0.0), True, age_s)


class Watched:
    """A watch with its clock."""

    def __init__(self) -> None:
        self.watch, self.now_ns = HeadingWatch(), 0

    def __call__(self, heading_deg: float, seconds: float, **more: float) -> str:
        for _ in range(round(seconds / 0.05)):
            self.now_ns += 50 * NS_PER_MS
            self.watch.take(self.now_ns, estimate(**more), math.radians(heading_deg))
        return self.watch.reason


@pytest.mark.parametrize(
    ("heading_deg", "seconds", "off"), [(-162.0, 2.0, True), (-170.0, 2.0, False), (-120.0, 0.7, False)]
)
def test_a_heading_is_off_that_differs_for_long(heading_deg: float, seconds: float, off: bool) -> None:
    assert ("off by 28 deg" in Watched()(heading_deg, seconds)) is off


@pytest.mark.parametrize("more", [{"std_deg": 6.0}, {"age_s": 0.6}])
def test_one_that_no_camera_knows_is_not_judged(more: dict[str, float]) -> None:
    assert Watched()(90.0, 3.0, **more) == ""


def test_it_is_trusted_again_when_it_has_been_right_for_a_second_and_on_the_floor() -> None:
    seen = Watched()
    assert seen(90.0, 1.0)
    assert seen(170.0, 0.9) and not seen(170.0, 0.2)
    seen(90.0, 1.0)
    seen.watch.reset()
    assert seen.watch.reason == ""


def test_two_headings_with_nothing_to_compare_between_them_are_not_in_a_row() -> None:
    seen = Watched()
    seen(90.0, 0.05)
    seen.watch.lose()
    seen.now_ns += 5000 * NS_PER_MS
    assert seen(90.0, 0.05) == ""

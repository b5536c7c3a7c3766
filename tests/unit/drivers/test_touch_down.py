"""Whether a vehicle comes down to the floor: by its believed height, its uncertainty and its sinking."""

import pytest

from drivers.touch_down import TouchDown
from groundstation.bus.messages import EntityEstimate


def estimate(height_m: float, climb_m_s: float = 0.0, std_m: float = 0.02, converged: bool = True) -> EntityEstimate:
    covariance = tuple(std_m**2 if place % 5 == 0 else 0.0 for place in range(16))
    mean, velocity = (0.0, 0.0, height_m, 0.0), (0.0, 0.0, climb_m_s)
    return EntityEstimate("drone_1", "robot", mean, covariance, velocity, converged, 0.0)


def flown() -> TouchDown:
    touch_down = TouchDown()
    touch_down.hear(estimate(1.2))
    assert not touch_down.of_flight(True)
    return touch_down


@pytest.mark.parametrize(
    ("height_m", "climb_m_s", "std_m", "touches"),
    [
        (0.15, 0.0, 0.02, False),
        (0.13, 0.0, 0.02, True),
        (0.13, 0.4, 0.02, True),
        (0.4, -0.4, 0.02, False),
        (0.28, -0.4, 0.02, True),
        (1.0, -1.3, 0.02, False),
        (0.9, -1.3, 0.02, True),
        (0.25, 0.0, 0.07, False),
        (0.25, 0.0, 0.08, True),
        (0.35, 0.0, 1.0, False),
        (-0.3, 0.0, 0.02, True),
    ],
)
def test_it_touches_down_a_hands_breadth_above_the_floor(height_m, climb_m_s, std_m, touches):
    """Two deviations count, 0.2 m of them at most, and what it sinks until it would be caught."""
    touch_down = flown()
    touch_down.hear(estimate(height_m, climb_m_s, std_m))
    assert touch_down.of_flight(True) is touches


def test_a_drone_that_has_not_risen_yet_does_not_come_down():
    touch_down = TouchDown()
    for height_m in (0.0, 0.1, 0.12, 0.05):
        touch_down.hear(estimate(height_m))
        assert not touch_down.of_flight(True)
    touch_down.hear(estimate(0.2))
    touch_down.hear(estimate(0.1))
    assert touch_down.of_flight(True)


def test_nobody_knows_the_height_of_a_drone_without_an_estimate():
    assert not TouchDown().of_flight(True)


def test_it_goes_on_touching_down_once_nobody_sees_it_any_more():
    touch_down = flown()
    touch_down.hear(estimate(0.1))
    assert all(touch_down.of_flight(True) for _ in range(100))
    touch_down.hear(estimate(0.5, 0.4))
    assert not touch_down.of_flight(True), "it climbs again"


def test_the_ground_ends_it():
    touch_down = flown()
    touch_down.hear(estimate(0.05))
    assert touch_down.of_flight(True) and not touch_down.of_flight(False)
    assert not touch_down.of_flight(True), "a new take-off"


@pytest.mark.parametrize(
    ("height_m", "climb_m_s", "std_m", "low"),
    [(0.1, 0.0, 0.1, True), (0.05, -0.3, 0.02, True), (0.1, 0.0, 0.11, False), (0.11, -1.0, 0.02, False)],
)
def test_it_is_down_if_its_height_is_known_and_low(height_m, climb_m_s, std_m, low):
    touch_down = flown()
    touch_down.hear(estimate(height_m, climb_m_s, std_m))
    assert touch_down.of_flight(True) or not low
    assert touch_down.low is low


def test_nobody_is_down_who_has_not_risen():
    touch_down = TouchDown()
    touch_down.hear(estimate(0.05))
    assert not touch_down.low


def test_an_estimate_that_is_no_drones_says_nothing():
    touch_down = flown()
    touch_down.hear(EntityEstimate("drone_1", "target", (0.0, 0.0), (0.0,) * 4, (0.0, 0.0), True, 0.0))
    assert not touch_down.of_flight(True)

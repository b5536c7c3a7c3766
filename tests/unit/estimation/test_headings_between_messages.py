"""The heading of a vehicle between its own headings, which come less often than the filter steps."""

import math

import pytest

from groundstation.estimation.models.driven import hold_velocity, take_heading
from groundstation.estimation.records import CondensedOdometry, EntityMemory
from groundstation.geometry.angles import wrap

STEP_S = 0.01
RATE_RAD_S = math.radians(60.0)


class Turner:
    """Feeds headings to the memory of one vehicle, and sums up what the filter takes it to turn."""

    def __init__(self) -> None:
        self._memory, self._told = EntityMemory.rows(1), CondensedOdometry.rows(1)
        self.turned_rad = 0.0

    def step(self, heading_rad: float | None, reset: int = 0) -> float:
        """Take one step, with a heading if there is one; returns the turn so far [rad]."""
        told = self._told[0]
        told["newest_at"] = -1.0 if heading_rad is None else 1.0
        told["newest_yaw"], told["newest_reset"] = wrap(heading_rad or 0.0), reset
        take_heading(told, self._memory[0], STEP_S)
        self.turned_rad += float(self._memory[0]["yaw_rate"]) * STEP_S
        return self.turned_rad


@pytest.mark.parametrize("every", [1, 2, 3, 5])
@pytest.mark.parametrize("start_rad", [0.0, 3.1])
def test_an_even_turn_is_followed_in_every_step_however_seldom_headings_come(every: int, start_rad: float) -> None:
    turner, first = Turner(), 2 * every
    for k in range(200):
        truth = RATE_RAD_S * STEP_S * k
        turned = turner.step(start_rad + truth if k % every == 0 else None)
        if k >= first:
            assert turned == pytest.approx(truth, abs=1e-9), k


def test_a_turn_that_ends_is_overshot_until_the_next_heading_only() -> None:
    turner = Turner()
    for k in range(20):
        turner.step(RATE_RAD_S * STEP_S * k if k % 2 == 0 else None)
    last = RATE_RAD_S * STEP_S * 18
    assert turner.turned_rad == pytest.approx(last + RATE_RAD_S * STEP_S)
    assert turner.step(last) == pytest.approx(last)
    assert turner.step(None) == pytest.approx(last)


def test_without_headings_it_turns_on_for_a_tenth_of_a_second() -> None:
    turner = Turner()
    for k in range(10):
        turner.step(RATE_RAD_S * STEP_S * k)
    for _ in range(100):
        turner.step(None)
    assert turner.turned_rad == pytest.approx(RATE_RAD_S * STEP_S * (9 + 10))


def test_a_heading_that_jumped_is_no_turn() -> None:
    turner = Turner()
    for k in range(10):
        turner.step(RATE_RAD_S * STEP_S * k)
    turner.step(None)
    before = turner.turned_rad
    assert turner.step(2.0, reset=1) == before
    assert turner.step(None, reset=1) == before


def test_a_jump_that_nobody_counted_is_no_turn() -> None:
    turner, jump_rad = Turner(), 1.0
    for k in range(20):
        turner.step(RATE_RAD_S * STEP_S * k if k % 2 == 0 else None)
    before = turner.turned_rad
    assert turner.step(RATE_RAD_S * STEP_S * 20 + jump_rad) == before
    for _ in range(20):
        assert turner.step(None) == before
    after = turner.step(RATE_RAD_S * STEP_S * 20 + jump_rad)
    assert turner.step(RATE_RAD_S * STEP_S * 21 + jump_rad) == pytest.approx(after + RATE_RAD_S * STEP_S)


def test_a_turn_faster_than_any_vehicles_is_taken_once_and_not_continued() -> None:
    """Headings that are stamped unevenly show such rates."""
    turner, step_rad = Turner(), 0.15
    for k in range(20):
        turner.step(RATE_RAD_S * STEP_S * k if k % 2 == 0 else None)
    stepped = turner.step(RATE_RAD_S * STEP_S * 20 + step_rad)
    assert stepped == pytest.approx(RATE_RAD_S * STEP_S * 20 + step_rad)
    for _ in range(20):
        assert turner.step(None) == stepped


def test_a_vehicle_that_fell_silent_has_no_smoothed_velocity() -> None:
    memory, told, nothing = EntityMemory.rows(1), CondensedOdometry.rows(1), CondensedOdometry.rows(1)
    told["sum_vx"], told["sum_vy"], told["velocity_count"] = 0.5, -0.2, 1.0
    for _ in range(300):
        hold_velocity(told[0], memory[0], 0.2, STEP_S)
    assert memory["slow_vx"][0] == pytest.approx(0.5, rel=0.1)
    for _ in range(25):
        hold_velocity(nothing[0], memory[0], 0.2, STEP_S)
    assert [float(memory[name][0]) for name in ("held_vx", "slow_vx", "slow_vy")] == [0.0, 0.0, 0.0]

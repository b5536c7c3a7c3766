"""A planner that checks its time only now and then still ends within its budget."""

import pytest

from groundstation.planning.time_budget import TimeBudget


class Clock:
    """A clock that advances only by the planner's work."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def spent(budget_s: float, gaps_s: list[float]) -> float:
    """Return the time taken by a planner with these gaps between its checks, the last one repeated."""
    clock = Clock()
    budget = TimeBudget(budget_s, clock)
    for turn in range(1000):
        clock.now_s += gaps_s[min(turn, len(gaps_s) - 1)]
        if budget.must_stop():
            break
    return clock.now_s - 100.0


@pytest.mark.parametrize("gap_s", [0.0003, 0.004, 0.009])
def test_it_stops_before_the_next_question_would_come_too_late(gap_s: float) -> None:
    assert 0.04 - 2.0 * gap_s <= spent(0.04, [gap_s]) <= 0.04


def test_a_single_long_gap_is_forgotten() -> None:
    assert spent(0.04, [0.012, 0.0005]) > 0.036


def test_a_planner_already_late_stops_at_once() -> None:
    assert spent(0.01, [0.015]) == pytest.approx(0.015)

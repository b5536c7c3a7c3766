"""Searches of whole pictures: rare while all is tracked, frequent for unseen entities, within a budget."""

from collections.abc import Callable

import pytest

from drivers.camera.settings import DetectorSettings
from drivers.camera.whole_searches import SearchRates, WholeSearches

FRAME_NS = 66_666_667
Sought = Callable[[float], bool]


def searches(
    seconds: float, sought: Sought, *, sees: bool = False, misses: bool = True, cost_s: float = 0.01, phase_s: float = 0
) -> list[float]:
    """Return the times at which pictures at 15 Hz are searched whole [s]."""
    plan, found = WholeSearches(SearchRates.of(DetectorSettings(), 2.0), phase_s), []
    for k in range(round(15 * seconds)):
        if plan.is_due(k * FRAME_NS, sees, sought(k / 15)):
            plan.done(k * FRAME_NS, misses, cost_s)
            found.append(k / 15)
    return found


@pytest.mark.parametrize(
    ("sees", "misses", "each_s"), [(False, True, 0.5), (True, True, 1.0), (True, False, 2.0), (False, False, 0.5)]
)
def test_a_camera_that_hears_of_nothing_lost_searches_seldom(sees: bool, misses: bool, each_s: float) -> None:
    found = searches(6.0, lambda _: False, sees=sees, misses=misses)
    assert found == pytest.approx([each_s * k for k in range(len(found))], abs=0.07 * len(found))
    assert len(found) >= 5.0 / (each_s + 0.067)


def test_entities_unseen_by_any_camera_are_sought_in_every_second_picture() -> None:
    assert len(searches(4.0, lambda _: True, sees=True)) == 30


def test_a_search_begins_as_soon_as_a_target_is_sought() -> None:
    found = searches(4.0, lambda now_s: now_s >= 1.0, sees=True, misses=False)
    assert found[:2] == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize(("cost_s", "most"), [(0.03, 0.16), (0.06, 0.16), (0.17, 0.35)])
def test_the_number_of_searches_is_bounded_by_their_cost(cost_s: float, most: float) -> None:
    """A sixth of a processor, or the cost of the untargeted search."""
    found = searches(20.0, lambda _: True, cost_s=cost_s)
    assert cost_s * len(found) / 20.0 <= most
    assert len(found) >= len(searches(20.0, lambda _: False, cost_s=cost_s))


def test_searches_of_several_cameras_are_staggered() -> None:
    assert searches(1.0, lambda _: False, phase_s=0.25)[0] == pytest.approx(0.267, abs=0.01)


def test_a_marker_that_got_lost_is_searched_for_soon() -> None:
    plan = WholeSearches(SearchRates.of(DetectorSettings(), 2.0), 0.0)
    assert plan.is_due(0, sees=True, sought=False)
    plan.done(0, misses=False, cost_s=0.01)
    plan.lost(100_000_000)
    assert not plan.is_due(200_000_000, sees=True, sought=False)
    assert plan.is_due(250_000_000, sees=True, sought=False)


def test_a_camera_that_sees_nobody_any_more_says_so_at_once() -> None:
    """The tracker considers a camera without messages for 1.5 s dead, and holds the team."""
    plan = WholeSearches(SearchRates.of(DetectorSettings(), 2.0), 0.0)
    assert plan.is_due(0, sees=True, sought=False)
    plan.done(0, misses=False, cost_s=0.01)
    assert not plan.is_due(900_000_000, sees=True, sought=False)
    assert plan.is_due(900_000_000, sees=False, sought=False)

"""Cameras see a silent drone drift although it was commanded to hold its place."""

import pytest

from drivers.ardrone.adrift import AdriftWatch

S = 1_000_000_000
TURN_NS = S // 40


def watch(seconds, seen_m_s, holds=True, silent=True, watched=None):
    """Return the watch after this time, and its output then."""
    watched, said = watched or AdriftWatch(), False
    for turn in range(round(seconds * 40)):
        said = watched.step(S + turn * TURN_NS, holds, silent, seen_m_s)
    return watched, said


def test_its_own_hover_has_a_second_to_brake_it_and_cameras_time_to_see_it() -> None:
    assert not watch(1.3, (0.6, 0.0))[1]
    assert watch(1.4, (0.6, 0.0))[1]


@pytest.mark.parametrize("seen_m_s", [(0.08, 0.08), None])
def test_one_that_stands_or_is_not_seen_is_left_to_itself(seen_m_s) -> None:
    assert not watch(3.0, seen_m_s)[1]


@pytest.mark.parametrize("known", [{"holds": False}, {"silent": False}])
def test_one_that_is_heard_or_flown_is_not_adrift(known) -> None:
    assert watch(3.0, (0.6, 0.0), **known)[1] is False


def test_it_is_braked_to_rest_and_as_long_as_it_is_seen() -> None:
    watched, _ = watch(1.4, (0.0, 0.2))
    assert watched.step(3 * S, True, True, (0.0, 0.01))
    assert not watched.step(3 * S, True, True, None)
    assert not watched.step(3 * S, True, True, (0.0, 0.01)), "it stood, as far as is known"
    assert watched.step(3 * S, True, True, (0.0, 0.2))


def test_it_is_adrift_from_the_moment_on_and_not_at_the_very_speed_at_which_one_wanders() -> None:
    begun, late_ns = AdriftWatch(), S + 1_300_000_000
    assert not begun.step(S, True, True, (0.6, 0.0))
    assert not begun.step(late_ns - 1, True, True, (0.6, 0.0))
    assert not begun.step(late_ns, True, True, (0.12, 0.0))
    assert begun.step(late_ns, True, True, (0.121, 0.0))


@pytest.mark.parametrize("pause", [(False, True), (True, False)])
def test_one_that_was_heard_or_flown_meanwhile_has_its_time_to_brake_anew(pause) -> None:
    watched, _ = watch(1.4, (0.6, 0.0))
    assert watched.adrift
    assert not watched.step(3 * S, *pause, (0.6, 0.0))
    assert not watched.adrift
    assert not watched.step(4 * S, True, True, (0.6, 0.0)), "told again to hold its place just now"
    assert watched.step(4 * S + 1_300_000_000, True, True, (0.6, 0.0))

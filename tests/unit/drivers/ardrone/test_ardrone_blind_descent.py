"""A drone without velocity measurement descends while its driver brakes it, and is landed."""

import pytest

from drivers.ardrone.blind_descent import LOWEST_M, BlindDescent

S = 1_000_000_000


def told(heights: list[float], every_s: float, begins_s: float = 10.0) -> list[bool]:
    """Return whether a drone without floor in view that is to land sinks at each of some heights."""
    descent = BlindDescent()
    return [descent.step(round((begins_s + i * every_s) * S), True, True, height) for i, height in enumerate(heights)]


def test_it_sinks_until_it_is_low_and_is_then_told_to_land() -> None:
    heights = [1.2, 1.0, 0.5, LOWEST_M + 0.01, LOWEST_M, LOWEST_M + 0.1, 1.0]
    assert told(heights, 0.5) == [True] * 5 + [False] * 2, "an order to land is not taken back"


def test_from_there_it_sinks_on_for_a_moment_whatever_its_height_says() -> None:
    descent = BlindDescent()
    heights = [0.5, LOWEST_M, None, 0.0, None, None]
    assert [descent.step(S + i * S // 10, True, True, height) for i, height in enumerate(heights)] == [True] * 5 + [
        False
    ]
    assert not descent.step(3 * S, True, True, 1.0)


def test_a_low_drone_that_sees_the_floor_is_landed() -> None:
    descent = BlindDescent()
    assert descent.step(S, True, True, LOWEST_M)
    assert not descent.step(S + 1, True, False, LOWEST_M)
    assert not descent.step(S + 2, True, True, LOWEST_M)


@pytest.mark.parametrize(
    ("lands", "blind", "height_m", "sinks"),
    [(True, True, 1.0, True), (False, True, 1.0, False), (True, False, 1.0, False), (True, True, None, False)],
)
def test_only_who_is_blind_is_to_land_and_tells_its_height_sinks(
    lands: bool, blind: bool, height_m: float | None, sinks: bool
) -> None:
    assert BlindDescent().step(S, lands, blind, height_m) is sinks


def test_a_drone_that_regains_the_floor_is_landed_for_good() -> None:
    descent = BlindDescent()
    assert descent.step(S, True, True, 1.0)
    assert not descent.step(S + 1, True, False, 1.0)
    assert not descent.step(S + 2, True, True, 1.0)


def test_a_drone_that_does_not_descend_is_landed() -> None:
    assert told([1.0] * 5, 0.4) == [True] * 4 + [False]
    assert told([1.0, 0.95, 0.92, 0.91, 0.905, 0.7], 0.4) == [True] * 4 + [False] * 2, "0.1 m in 1.2 s are asked"
    assert told([1.0, 0.95, 0.91, 0.89, 0.88, 0.81, 0.78, 0.78], 0.4) == [True] * 8


def test_it_sinks_for_six_seconds_at_most() -> None:
    assert told([3.0 - 0.2 * i for i in range(9)], 1.0) == [True] * 7 + [False] * 2


def test_the_next_landing_begins_anew() -> None:
    descent = BlindDescent()
    assert not descent.step(S, True, False, 1.0)
    assert not descent.step(20 * S, False, True, 1.0)
    assert [descent.step(t * S, True, True, 1.0 - 0.1 * t / 10) for t in (21, 22, 28)] == [True, True, False]

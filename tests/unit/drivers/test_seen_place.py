"""The time at which a vehicle was where its estimate has it, by its last observation alone."""

from typing import Any

import pytest

from drivers.seen_place import last_seen
from groundstation.bus.messages import EntityEstimate

S = 1_000_000_000


def estimate(sighting: tuple[float, float] | None) -> EntityEstimate:
    values: dict[str, Any] = {"mean": (1.0, 2.0, 0.8, 0.0), "covariance": (0.15**2,) * 16}
    return EntityEstimate(
        name="v", kind="robot", velocity_m_s=(0.0, 0.0, 0.0), converged=True, age_s=0.1, sighting=sighting, **values
    )


def test_it_was_there_when_it_was_seen_as_well_as_it_was_known_right_after_that() -> None:
    assert last_seen(5 * S, estimate((0.25, 0.02))) == (4_750_000_000, 0.02)


@pytest.mark.parametrize(("sighting", "known"), [((0.4, 0.02), True), ((0.401, 0.02), False), ((0.1, 0.05), True)])
def test_a_picture_is_too_old_after_two_fifths_of_a_second(sighting: tuple[float, float], known: bool) -> None:
    assert (last_seen(5 * S, estimate(sighting)) is not None) is known


@pytest.mark.parametrize("sighting", [None, (0.1, 0.051)])
def test_one_that_was_never_seen_or_not_well_is_nowhere(sighting: tuple[float, float] | None) -> None:
    assert last_seen(5 * S, estimate(sighting)) is None

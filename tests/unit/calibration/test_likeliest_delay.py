"""The most likely delay of a recording: costs of single observations in, delay and deviation out."""

from collections.abc import Callable

import numpy as np
import pytest

from groundstation.calibration.likeliest import Costs, likeliest

PERIOD_NS = 66_000_000
SEEN = 900  # a minute at 15 Hz


def recorded(truth_ms: float, seed: int = 1, alike: int = 1, sharpness: float = 1e-4) -> Callable[[float], Costs]:
    """Return observations of which each, or each run of so many, has its own delay about the truth."""
    rng = np.random.default_rng(seed)
    own_ms = truth_ms + np.repeat(rng.normal(0.0, sharpness**-0.5, SEEN // alike), alike)

    def cost(later_ms: float) -> Costs:
        each = sharpness * (own_ms - later_ms) ** 2
        return {("drone_1", "target", k * PERIOD_NS): float(each[k]) for k in range(len(each))}

    return cost


@pytest.mark.parametrize("truth_ms", [0.0, 33.0, -50.0, 95.0])
def test_it_is_found_wherever_it_is_tried(truth_ms: float) -> None:
    found = likeliest(recorded(truth_ms))
    assert found is not None and found.later_ms == pytest.approx(truth_ms, abs=3.0 * found.std_ms)
    assert 2.5 < found.std_ms < 5.0  # 100 ms / sqrt(900)


def test_beyond_what_is_tried_there_is_none() -> None:
    assert likeliest(recorded(200.0)) is None


def test_where_errors_are_alike_for_a_second_it_is_as_unsure_as_it_scatters() -> None:
    found = [likeliest(recorded(0.0, seed, alike=15)) for seed in range(40)]
    told = [one for one in found if one is not None]
    scatter_ms = float(np.std([one.later_ms for one in told]))
    assert len(told) == 40 and 10.0 < scatter_ms < 18.0
    assert np.median([one.std_ms for one in told]) == pytest.approx(scatter_ms, rel=0.3)


def test_only_what_was_used_under_every_delay_is_compared() -> None:
    """An observation that is too late under some delay must not make that delay cheaper."""
    cost = recorded(20.0)

    def refused(later_ms: float) -> Costs:
        return dict(list(cost(later_ms).items())[: 500 if later_ms < 0.0 else None])

    found, whole = likeliest(refused), likeliest(cost)
    assert found is not None and whole is not None
    assert found.later_ms == pytest.approx(20.0, abs=3.0 * found.std_ms) and found.std_ms > whole.std_ms


@pytest.mark.parametrize("seconds", [0.0, 8.0])
def test_a_short_recording_yields_no_delay(seconds: float) -> None:
    cost = recorded(0.0)

    def short(later_ms: float) -> Costs:
        return {seen: one for seen, one in cost(later_ms).items() if seen[2] < seconds * 1e9}

    found = likeliest(short)
    assert found is None or not np.isfinite(found.std_ms)

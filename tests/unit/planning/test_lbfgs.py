"""The local search that both planners share, on functions whose minimum is known."""

from collections.abc import Callable

import numpy as np
import pytest

from groundstation.arrays import Array
from groundstation.planning.lbfgs import Descent, descent_from, take

Function = Callable[[Array], tuple[float, Array]]


def minimised(function: Function, start: Array, most: int = 60) -> tuple[Descent, int]:
    descent = descent_from(start, 0.0)
    progress = descent.progress[0]
    while not progress["over"] and progress["evaluations"] < most:
        cost, gradient = function(descent.trial)
        descent.trial_gradient[:] = gradient
        take(descent, cost, 1e-6, 0.0)
    return descent, int(progress["evaluations"])


def bowl(x: Array) -> tuple[float, Array]:
    """Lowest at (0.3, -0.4), and steeper in one direction than in the other."""
    at, weights = np.array([0.3, -0.4]), np.array([1.0, 30.0])
    return 1.0 + float(weights @ (x - at) ** 2), 2.0 * weights * (x - at)


def lamp(x: Array) -> tuple[float, Array]:
    """Nearly flat, and curved downwards, but for a narrow well about 0.9: the minimum is far away."""
    depth = np.exp(-((x - 0.9) ** 2) / 0.04)
    return 2.0 - float(depth.sum()), depth * (x - 0.9) / 0.02


def test_a_bowl_is_left_at_its_bottom() -> None:
    descent, evaluations = minimised(bowl, np.array([-1.0, 1.0]))
    np.testing.assert_allclose(descent.x, [0.3, -0.4], atol=1e-5)
    assert evaluations < 20


def test_a_bottom_outside_of_the_box_is_looked_for_at_its_wall() -> None:
    def aside(x: Array) -> tuple[float, Array]:
        cost, gradient = bowl(x + 1.0)
        return cost, gradient

    descent, _ = minimised(aside, np.zeros(2))
    np.testing.assert_allclose(descent.x, [-0.7, -1.0], atol=1e-5)


@pytest.mark.parametrize("start", [0.3, 0.5, 0.6])
def test_where_the_cost_curves_downwards_the_search_goes_on_in_long_steps(start: float) -> None:
    descent, evaluations = minimised(lamp, np.array([start, start]))
    np.testing.assert_allclose(descent.x, [0.9, 0.9], atol=1e-4)
    assert evaluations < 20


def test_a_first_cost_that_is_not_finite_ends_it() -> None:
    descent, evaluations = minimised(lambda x: (np.nan, x), np.array([0.5]))
    assert (descent.x.tolist(), evaluations) == ([0.5], 1)
    assert descent.progress[0]["cost"] == np.inf

"""Student's interval of a mean."""

import math

import numpy as np
import pytest
from scipy.stats import t as student

from groundstation.estimation.mean_interval import half_width


def test_few_values_have_wide_intervals() -> None:
    assert half_width([1.0, 2.0]) == pytest.approx(12.706 / 2.0, abs=1e-3)
    values = np.random.default_rng(1).normal(0.0, 1.0, 7).tolist()
    low, high = student.interval(0.95, 6, np.mean(values), np.std(values, ddof=1) / math.sqrt(7))
    assert 2.0 * half_width(values) == pytest.approx(high - low)


def test_one_value_says_nothing_of_its_error() -> None:
    assert math.isnan(half_width([1.0])) and math.isnan(half_width([]))

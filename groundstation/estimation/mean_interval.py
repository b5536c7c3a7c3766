"""The uncertainty of a mean over a few independent values: Student's interval."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

CONFIDENCE = 0.95


def half_width(values: Sequence[float]) -> float:
    """Return half the width of the two-sided 95 % interval of the values' mean; NaN for fewer than two."""
    freedom = len(values) - 1
    if freedom < 1:
        return math.nan
    factor = float(stdtrit(freedom, (1.0 + CONFIDENCE) / 2.0))
    return factor * float(np.std(values, ddof=1)) / math.sqrt(len(values))

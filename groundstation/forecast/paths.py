"""Places along a target's path, evenly spaced."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from groundstation.forecast.team import Place


def spaced(path: Sequence[Place], most: int) -> list[Place]:
    """Return at most `most` places along the line through a path's points, from the first to the last."""
    if len(path) < 2:
        return list(path)
    lengths = np.cumsum([0.0, *(math.dist(a, b) for a, b in pairwise(path))])
    x, y = np.array(path, dtype=np.float64).T
    at = np.linspace(0.0, lengths[-1], most)
    return list(zip(np.interp(at, lengths, x).tolist(), np.interp(at, lengths, y).tolist(), strict=True))

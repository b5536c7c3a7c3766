"""Places along a target's path, evenly spaced."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from groundstation.forecast.team import Place


def spaced(path: Sequence[Place], most: int) -> list[Place]:
    """Return places along a line through the points of a path, from its first to its last, at most so many."""
    if len(path) < 2:
        return list(path)
    lengths = np.cumsum([0.0, *(math.dist(a, b) for a, b in pairwise(path))])
    x, y = np.array(path, dtype=np.float64).T
    at = np.linspace(0.0, lengths[-1], most)
    return list(zip(np.interp(at, lengths, x).tolist(), np.interp(at, lengths, y).tolist(), strict=True))

"""Finds the maximum-likelihood delay of a camera in a recording, and its uncertainty."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.parabola import Least, least
from groundstation.time_units import NS_PER_S

# Delays are tried at this spacing until one is better than its neighbours, then at half of it around that one.
_COARSE_MS, _FARTHEST_MS = 40.0, 120.0
# Errors are seldom correlated over longer than this.
_BLOCK_NS = 3 * NS_PER_S
_LEAST_BLOCKS = 5

Costs = Mapping[tuple[str, str, int], float]
"""Minus twice the log-likelihood of each observation, by observer, subject and recorded stamp [ns]."""


class Likeliest(NamedTuple):
    """A camera's delay beyond its setting, and one sigma [ms]; infinite if undetermined."""

    later_ms: float
    std_ms: float


def likeliest(cost: Callable[[float], Costs]) -> Likeliest | None:
    """Return the delay with the least sum of costs; None if that is at the end of the range tried.

    cost: of all observations under an additional delay of the camera [ms].
    """
    tried = {0.0: cost(0.0)}
    if len({stamp // _BLOCK_NS for *_, stamp in tried[0.0]}) < _LEAST_BLOCKS:
        return Likeliest(0.0, np.inf)
    tried |= {later_ms: cost(later_ms) for later_ms in (-_COARSE_MS, _COARSE_MS)}
    while (best := _best(tried)) in (min(tried), max(tried)):
        if abs(best) >= _FARTHEST_MS:
            return None
        outwards = best + float(np.copysign(_COARSE_MS, best))
        tried[outwards] = cost(outwards)
    near = {later_ms: tried[later_ms] for later_ms in (best - _COARSE_MS, best, best + _COARSE_MS)}
    near |= {later_ms: cost(later_ms) for later_ms in (best - 0.5 * _COARSE_MS, best + 0.5 * _COARSE_MS)}
    return _fitted(*_by_block(near))


def _best(tried: Mapping[float, Costs]) -> float:
    later_ms, blocks = _by_block(tried)
    return float(later_ms[np.argmin(blocks.sum(axis=0))])


def _by_block(tried: Mapping[float, Costs]) -> tuple[Array, Array]:
    """Return the delays tried (n) and their costs (blocks of time, n), of observations used under all of them."""
    later_ms = sorted(tried)
    common = sorted(set.intersection(*(set(costs) for costs in tried.values())), key=lambda seen: seen[2])
    stamps = np.array([stamp for _, _, stamp in common], dtype=np.int64)
    _, block = np.unique(stamps // _BLOCK_NS, return_inverse=True)
    table = np.zeros((block.max(initial=-1) + 1, len(later_ms)))
    for column, one in enumerate(later_ms):
        np.add.at(table[:, column], block, [tried[one][seen] for seen in common])
    return np.array(later_ms), table


def _fitted(later_ms: Array, blocks: Array) -> Likeliest:
    """Return the minimum; its deviation comes from leaving out one block of time at a time (jackknife).

    A drifting heading dents the cost, so its curvature alone would give too small a deviation.
    """
    total, count = blocks.sum(axis=0), len(blocks)
    whole = _minimum(later_ms, total)
    others = [_minimum(later_ms, total - block) for block in blocks]
    if whole is None or None in others:
        return Likeliest(0.0, np.inf)
    places = np.array([one.place for one in others if one is not None])
    variance = (count - 1) / count * float(((places - places.mean()) ** 2).sum())
    return Likeliest(whole.place, float(np.sqrt(max(variance, 1.0 / whole.curvature))))


def _minimum(later_ms: Array, costs: Array) -> Least | None:
    found = least(later_ms, costs, len(later_ms))
    return found if found is not None and found.curvature > 0.0 else None

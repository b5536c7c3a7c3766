"""Candidate topologies as level vectors (0 is seen by the global sensor): neighbours, radial cuts, merges, all."""

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

Levels = NDArray[np.int64]

_i1, _i2, _i8 = types.int64[::1], types.int64[:, ::1], types.int64


@njit(_i8(_i1, _i8, _i8, _i1), cache=True, nogil=True)
def _move(level, robot, to, out):  # type: ignore[no-untyped-def]
    """Write the level vector with one robot moved to a level (-1 and L open new ones), without empty levels."""
    n = level.shape[0]
    alone = True
    for a in range(n):
        alone = alone and (a == robot or level[a] != level[robot])
    for a in range(n):
        out[a] = to if a == robot else level[a]
        if alone and out[a] > level[robot]:
            out[a] -= 1
    if to < 0:
        for a in range(n):
            out[a] += 1
    return 1


@njit(_i8(_i1, _i2), cache=True, nogil=True)
def neighbours(level, out):  # type: ignore[no-untyped-def]
    """Write all topologies one robot-move away, each once, into out (2n, n); return how many.

    Only two moves can give the same topology twice: merging two single-robot levels, and splitting a pair
    that is the whole team; the second of each is left out.
    """
    n = level.shape[0]
    sizes = np.zeros(n, np.int64)
    for a in range(n):
        sizes[level[a]] += 1
    last = 0
    for a in range(n):
        last = max(last, level[a])
    count = 0
    for robot in range(n):
        own = level[robot]
        alone = sizes[own] == 1
        if own > 0 and not (alone and sizes[own - 1] == 1):
            count += _move(level, robot, own - 1, out[count])
        if own == 0 and not alone:
            count += _move(level, robot, -1, out[count])
        if own < last:
            count += _move(level, robot, own + 1, out[count])
        if own == last and not alone and not (n == 2 and last == 0):
            count += _move(level, robot, last + 1, out[count])
    return count


def radial_cuts(mean: NDArray[np.float64], most: int = 6) -> Levels:
    """Return the team sorted by distance to the global sensor and cut into 1..most equal groups (k, n)."""
    robots = len(mean) - 1
    order = np.argsort(np.hypot(mean[:-1, 0], mean[:-1, 1]), kind="stable")
    cuts = np.empty((min(most, robots), robots), dtype=np.int64)
    for k in range(len(cuts)):
        cuts[k, order] = np.arange(robots) * (k + 1) // robots
    return cuts


def merges(level: Levels) -> Levels:
    """Return the topologies in which two adjacent levels have become one (L - 1, n)."""
    return np.array([level - (level > k) for k in range(int(level.max()))], dtype=np.int64).reshape(-1, len(level))


def all_topologies(robots: int) -> Levels:
    """Return all ordered partitions of the team; raises ValueError above 6 robots (4683 topologies)."""
    if robots > 6:
        raise ValueError(f"all topologies are searched for at most 6 robots (got {robots})")
    grid = np.indices((robots,) * robots).reshape(robots, -1).T
    filled = [len(set(row)) == row.max() + 1 for row in grid]
    return np.ascontiguousarray(grid[filled], dtype=np.int64)

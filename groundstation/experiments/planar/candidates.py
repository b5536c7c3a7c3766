"""Candidate topologies as level vectors (0 is seen by the global sensor): neighbours, radial cuts, merges, all."""

import numpy as np
from numba import njit, types

from groundstation.arrays import IntArray

MOST_CUTS = 6

_i1, _i2, _i8, _f2 = types.int64[::1], types.int64[:, ::1], types.int64, types.float64[:, ::1]


@njit(types.void(_i1, _i8, _i8, types.boolean, _i1), cache=True, nogil=True)
def _move(level, robot, to, alone, out):  # type: ignore[no-untyped-def]
    """Write the level vector with one robot moved to a level (-1 and L open new ones), without empty levels."""
    own = level[robot]
    for a in range(level.shape[0]):
        out[a] = to if a == robot else level[a]
        if alone and out[a] > own:
            out[a] -= 1
        if to < 0:
            out[a] += 1


@njit(_i8(_i1, _i2), cache=True, nogil=True)
def neighbours(level, out):  # type: ignore[no-untyped-def]
    """Write all topologies one robot-move away, each once, into out (2n, n); return how many.

    Only two moves can give the same topology twice: merging two single-robot levels, and splitting a pair
    that is the whole team; the second of each is left out.
    """
    n = level.shape[0]
    sizes = np.zeros(n, np.int64)
    last = 0
    for a in range(n):
        sizes[level[a]] += 1
        last = max(last, level[a])
    count = 0
    for robot in range(n):
        own = level[robot]
        alone = sizes[own] == 1
        for to in (own - 1, own + 1):
            if to < 0 and alone:
                continue
            if to > last and (alone or (n == 2 and last == 0)):
                continue
            if 0 <= to < own and alone and sizes[to] == 1:
                continue
            _move(level, robot, to, alone, out[count])
            count += 1
    return count


@njit(_i8(_f2, _i8, _i2), cache=True, nogil=True)
def radial_cuts(mean, most, out):  # type: ignore[no-untyped-def]
    """Write the team sorted by distance to the global sensor and cut into 1..most equal groups; return how many.

    mean (n + 1, 2), target last; out (most, n).
    """
    robots = mean.shape[0] - 1
    order = np.argsort(np.hypot(mean[:robots, 0], mean[:robots, 1]), kind="mergesort")
    count = min(most, robots)
    for k in range(count):
        for place in range(robots):
            out[k, order[place]] = place * (k + 1) // robots
    return count


@njit(_i8(_i1, _i2), cache=True, nogil=True)
def merges(level, out):  # type: ignore[no-untyped-def]
    """Write the topologies in which two adjacent levels have become one, into out (n - 1, n); return how many."""
    last = 0
    for own in level:
        last = max(last, own)
    for k in range(last):
        for a in range(level.shape[0]):
            out[k, a] = level[a] - (1 if level[a] > k else 0)
    return last


@njit(_i8(_i2, _i8), cache=True, nogil=True)
def _without_repeats(rows, count):  # type: ignore[no-untyped-def]
    """Keep the first of equal rows, in order; return how many are left."""
    kept = 0
    for candidate in range(count):
        seen = False
        for earlier in range(kept):
            same = True
            for a in range(rows.shape[1]):
                if rows[earlier, a] != rows[candidate, a]:
                    same = False
                    break
            if same:
                seen = True
                break
        if not seen:
            for a in range(rows.shape[1]):
                rows[kept, a] = rows[candidate, a]
            kept += 1
    return kept


@njit(_i8(_i1, _f2, types.boolean, _i2), cache=True, nogil=True)
def candidate_list(level, mean, wide, out):  # type: ignore[no-untyped-def]
    """Write the current topology, its neighbours and, if `wide`, radial cuts and merges, each once; return how many.

    out (3n + MOST_CUTS + 1, n).
    """
    for a in range(level.shape[0]):
        out[0, a] = level[a]
    count = 1 + neighbours(level, out[1:])
    if wide:
        count += radial_cuts(mean, MOST_CUTS, out[count:])
        count += merges(level, out[count:])
        count = _without_repeats(out, count)
    return count


def all_topologies(robots: int) -> IntArray:
    """Return all ordered partitions of the team; raises ValueError above 6 robots (4683 topologies)."""
    if robots > 6:
        raise ValueError(f"all topologies are searched for at most 6 robots (got {robots})")
    grid = np.indices((robots,) * robots).reshape(robots, -1).T
    filled = [len(set(row)) == row.max() + 1 for row in grid]
    return np.ascontiguousarray(grid[filled], dtype=np.int64)

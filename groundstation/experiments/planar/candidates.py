"""Candidate topologies as level vectors (0 is seen by the global sensor): neighbours, radial cuts, merges, all."""

import numpy as np

from groundstation.arrays import IntArray, IntMatrix, IntVector, Matrix
from groundstation.experiments.planar.records import X, Y
from groundstation.kernel import kernel

MOST_CUTS = 6


@kernel()
def _move(level: IntVector, robot: int, to: int, alone: bool, out: IntVector) -> None:
    """Write the level vector with one robot moved to a level (-1 and L open new ones), without empty levels."""
    own = level[robot]
    for a in range(level.shape[0]):
        out[a] = to if a == robot else level[a]
        if alone and out[a] > own:
            out[a] -= 1
        if to < 0:
            out[a] += 1


@kernel()
def neighbours(level: IntVector, out: IntMatrix) -> int:
    """Write all topologies one robot-move away, each once, into out (2n, n); return how many.

    Only two moves can give the same topology twice: merging two single-robot levels, and splitting a pair
    that is the whole team; the second of each is left out.
    """
    n = level.shape[0]
    sizes = np.zeros(n, np.int64)
    last = 0
    for a in range(n):
        sizes[level[a]] += 1
        last = max(last, int(level[a]))
    count = 0
    for robot in range(n):
        own = int(level[robot])
        alone = bool(sizes[own] == 1)
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


@kernel()
def radial_cuts(mean: Matrix, most: int, out: IntMatrix) -> int:
    """Write the team sorted by distance to the global sensor and cut into 1..most equal groups; return how many.

    mean (n + 1, 2), target last; out (most, n).
    """
    robots = mean.shape[0] - 1
    order = np.argsort(np.hypot(mean[:robots, X], mean[:robots, Y]), kind="mergesort")
    count: int = min(most, robots)
    for k in range(count):
        for place in range(robots):
            out[k, order[place]] = place * (k + 1) // robots
    return count


@kernel()
def merges(level: IntVector, out: IntMatrix) -> int:
    """Write the topologies with two adjacent levels merged into out (n - 1, n); return their number."""
    last = 0
    for own in level:
        last = max(last, int(own))
    for k in range(last):
        for a in range(level.shape[0]):
            out[k, a] = level[a] - (1 if level[a] > k else 0)
    return last


@kernel()
def _without_repeats(rows: IntMatrix, count: int) -> int:
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


@kernel()
def candidate_list(level: IntVector, mean: Matrix, wide: bool, out: IntMatrix) -> int:
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

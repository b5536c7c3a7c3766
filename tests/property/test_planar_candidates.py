"""Candidates of the planar planner are the topologies that `sensing.topology` defines."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bench.planner_peers.step import edges_of, neighbours_of
from groundstation.experiments.planar.candidates import all_topologies, candidate_list, merges, neighbours, radial_cuts
from groundstation.experiments.planar.edges import sort_team
from groundstation.experiments.planar.records import Observers
from groundstation.sensing.topology import LEAF, ROOT, Topology

NAMES = "abcdefghijkl"


def topology_of(level: tuple[int, ...]) -> Topology:
    rows = [frozenset(NAMES[a] for a, own in enumerate(level) if own == k) for k in range(max(level) + 1)]
    return Topology(tuple(rows))


def compiled_neighbours(level: tuple[int, ...]) -> list[tuple[int, ...]]:
    out = np.empty((2 * len(level), len(level)), dtype=np.int64)
    return [tuple(map(int, row)) for row in out[: neighbours(np.array(level, dtype=np.int64), out)]]


def compiled_edges(level: tuple[int, ...]) -> set[tuple[str, str]]:
    n = len(level)
    order, seen = np.empty(n + 1, dtype=np.int64), Observers(*np.zeros((3, n + 2), dtype=np.uint64))
    sort_team(np.array(level, dtype=np.int64), order, seen)
    names = [*(NAMES[a] for a in order[:-1]), LEAF]
    edges = {
        (ROOT if row == 0 else names[row - 1], names[b])
        for row in range(n + 1)
        for b in range(int(seen.first[row]), int(seen.end[row]))
    }
    assert len(edges) == seen.edge[n + 1]
    return edges


@pytest.mark.parametrize(("robots", "count"), [(1, 1), (2, 3), (3, 13), (4, 75), (5, 541)])
def test_every_topology_of_small_teams(robots: int, count: int) -> None:
    levels = [tuple(map(int, row)) for row in all_topologies(robots)]
    assert len(set(levels)) == len(levels) == count
    for level in levels:
        topology = topology_of(level)
        found = compiled_neighbours(level)
        assert len(found) == len(set(found)) <= 2 * robots
        assert {topology_of(row) for row in found} == set(topology.neighbours())
        assert set(found) == set(neighbours_of(level))
        assert compiled_edges(level) == set(topology.edges())
        assert len(edges_of(level)) == len(topology.edges())


def test_six_robots() -> None:
    assert len(all_topologies(6)) == 4683
    with pytest.raises(ValueError, match="at most 6"):
        all_topologies(7)


LEVELS = st.lists(st.integers(0, 5), min_size=1, max_size=12).map(
    lambda raw: tuple(int(k) for k in np.unique(raw, return_inverse=True)[1])
)


@settings(max_examples=60, deadline=None)
@given(LEVELS, st.integers(0, 1000))
def test_wide_candidates(level: tuple[int, ...], seed: int) -> None:
    n = len(level)
    mean = np.random.default_rng(seed).normal(size=(n + 1, 2))
    rows = np.empty((3 * n + 7, n), dtype=np.int64)
    count = candidate_list(np.array(level, dtype=np.int64), mean, True, rows)
    found = [tuple(map(int, row)) for row in rows[:count]]
    assert found[0] == level and len(set(found)) == count
    assert set(neighbours_of(level)) <= set(found)
    assert all(set(row) == set(range(max(row) + 1)) for row in found)
    assert set(topology_of(level).neighbours()) <= {topology_of(row) for row in found}


@settings(max_examples=30, deadline=None)
@given(LEVELS, st.integers(0, 1000))
def test_cuts_follow_the_distance_and_merges_join(level: tuple[int, ...], seed: int) -> None:
    n = len(level)
    mean = np.random.default_rng(seed).normal(size=(n + 1, 2))
    out = np.empty((max(6, n), n), dtype=np.int64)
    order = np.argsort(np.hypot(*mean[:-1].T))
    for k in range(radial_cuts(mean, 6, out)):
        assert (np.diff(out[k, order]) >= 0).all()
        sizes = np.bincount(out[k])
        assert len(sizes) == k + 1 and sizes.max() - sizes.min() <= 1
    assert merges(np.array(level, dtype=np.int64), out) == max(level)
    for k in range(max(level)):
        assert out[k].max() == max(level) - 1

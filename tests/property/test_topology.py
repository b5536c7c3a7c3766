"""Topologies are ordered partitions; neighbours connect all of them, both ways."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.sensing.topology import LEAF, ROOT, Topology

NAMES = "abcdef"
ORDERED_PARTITIONS = {1: 1, 2: 3, 3: 13, 4: 75, 5: 541, 6: 4683}


def reachable(start: Topology) -> set[Topology]:
    seen = {start}
    frontier = [start]
    while frontier:
        frontier = [n for n in {n for t in frontier for n in t.neighbours()} if n not in seen]
        seen.update(frontier)
    return seen


@st.composite
def topologies(draw: st.DrawFn) -> Topology:
    names = draw(st.lists(st.text("abcxyz_19", min_size=1, max_size=4), min_size=1, max_size=7, unique=True))
    ranks = draw(st.lists(st.integers(0, 6), min_size=len(names), max_size=len(names)))
    levels = [frozenset(n for n, r in zip(names, ranks, strict=True) if r == rank) for rank in sorted(set(ranks))]
    return Topology(tuple(levels))


@pytest.mark.parametrize("n", range(1, 6))
def test_all_ordered_partitions_are_reachable_from_string_and_from_flat(n: int) -> None:
    from_string = reachable(Topology.string(NAMES[:n]))
    assert len(from_string) == ORDERED_PARTITIONS[n]
    assert reachable(Topology.flat(NAMES[:n])) == from_string


def test_six_robots_have_4683_topologies() -> None:
    assert len(reachable(Topology.flat(NAMES))) == ORDERED_PARTITIONS[6]


@pytest.mark.parametrize("n", range(1, 5))
def test_all_topologies_lead_back(n: int) -> None:
    everything = reachable(Topology.flat(NAMES[:n]))
    predecessors: dict[Topology, set[Topology]] = {t: set() for t in everything}
    for topology in everything:
        for neighbour in topology.neighbours():
            predecessors[neighbour].add(topology)
    seen = {Topology.string(NAMES[:n])}
    frontier = set(seen)
    while frontier:
        frontier = set().union(*(predecessors[t] for t in frontier)) - seen
        seen |= frontier
    assert seen == everything


@given(topologies())
@settings(max_examples=60, deadline=None)
def test_neighbours_are_few_distinct_and_over_the_same_robots(topology: Topology) -> None:
    neighbours = topology.neighbours()
    assert len(neighbours) <= 2 * len(topology.robots)
    assert len(set(neighbours)) == len(neighbours)
    assert topology not in neighbours
    assert all(n.robots == topology.robots for n in neighbours)


@given(topologies())
@settings(max_examples=60, deadline=None)
def test_text_form_round_trips_and_hashes_alike(topology: Topology) -> None:
    again = Topology.parse(str(topology))
    assert again == topology
    assert hash(again) == hash(topology)


@given(topologies())
@settings(max_examples=60, deadline=None)
def test_edges_join_adjacent_levels_only(topology: Topology) -> None:
    depth = {ROOT: -1, LEAF: len(topology.levels)} | {name: topology.level_of(name) for name in topology.robots}
    edges = topology.edges()
    assert len(set(edges)) == len(edges)
    assert all(depth[b] == depth[a] + 1 for a, b in edges)
    sizes = [1, *(len(level) for level in topology.levels), 1]
    assert len(edges) == sum(a * b for a, b in pairwise(sizes))


@given(topologies(), st.sets(st.sampled_from(["a", "b", "c", "new1", "new2"])))
@settings(max_examples=60, deadline=None)
def test_reconciled_holds_exactly_the_given_robots_in_their_order(topology: Topology, names: set[str]) -> None:
    result = topology.reconciled(names)
    assert result.robots == names
    kept = sorted(names & topology.robots, key=topology.level_of)
    assert [result.level_of(n) for n in kept] == sorted(result.level_of(n) for n in kept)


def test_a_string_of_two_has_one_neighbour_and_a_flat_pair_two() -> None:
    assert [str(t) for t in Topology.parse("a/b").neighbours()] == ["a,b"]
    assert {str(t) for t in Topology.parse("a,b").neighbours()} == {"a/b", "b/a"}
    assert Topology(()).neighbours() == () and Topology(()).edges() == ()


@pytest.mark.parametrize("text", ["a//b", "a,a", "a/a", ",", "/", "a,b/", "@root"])
def test_malformed_text_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"level|twice|names"):
        Topology.parse(text)

"""Stops of a second ground station: the first is sent at once, none is lost, and the last one arrives last."""

import itertools

from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.stop_queue import StopQueue

MS = 1_000_000


def played(stops, until_ns):
    """Return (time, stop) of all forwarded stops; stops: (time, kind), each with its number as bytes."""
    queue, passed, left = StopQueue(), [], list(enumerate(stops))
    for now_ns in range(0, until_ns, MS):
        while left and left[0][1][0] <= now_ns:
            number, (_, kind) = left.pop(0)
            queue.put(kind, bytes([number]))
        if (stop := queue.take(now_ns)) is not None:
            passed.append((now_ns, stop[0]))
    return passed


def test_one_stop_passes_at_once_and_nothing_waits_behind_it():
    queue = StopQueue()
    assert queue.wait_ns(0) is None and queue.take(0) is None
    queue.put("land", b"a")
    assert queue.wait_ns(5) == 0
    assert queue.take(5) == b"a" and queue.take(5) is None and queue.wait_ns(5) is None


def test_of_a_flood_of_equal_stops_fifty_a_second_pass_and_the_last_one():
    passed = played([(n * MS, "land") for n in range(200)], 400 * MS)
    assert len(passed) == 11 and passed[0] == (0, 0) and passed[-1][1] == 199


def test_another_stop_waits_20_ms_at_most_in_a_flood():
    flood = [(n * MS, "hold") for n in range(100)]
    passed = played(sorted([*flood, (50 * MS, "land")]), 300 * MS)
    number = next(n for n, (at, kind) in enumerate(sorted([*flood, (50 * MS, "land")])) if kind == "land")
    assert next(at for at, stop in passed if stop == number) <= 90 * MS


@given(st.lists(st.tuples(st.integers(0, 100), st.sampled_from("abc")), min_size=1, max_size=60))
def test_every_stop_or_an_equal_later_one_passes_and_the_last_one_is_last(stops):
    stops = sorted((at * MS, kind) for at, kind in stops)
    passed = [stop for _, stop in played(stops, 500 * MS)]
    for number, (_, kind) in enumerate(stops):
        assert any(stop >= number and stops[stop][1] == kind for stop in passed)
    assert passed[-1] == len(stops) - 1
    times = [at for at, _ in played(stops, 500 * MS)]
    assert all(after - before >= 20 * MS for before, after in itertools.pairwise(times))

"""The clock of stamps: this host's own, or the run's host's clock by a measured offset."""

import time
from collections.abc import Iterator

import pytest

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange


@pytest.fixture(autouse=True)
def own_again() -> Iterator[None]:
    yield
    clock.follow_none()


def test_a_process_of_another_host_stamps_by_the_clock_of_the_run() -> None:
    clock.follow("run", lambda: 895 * 10**9)
    header = MemoryBus(MemoryExchange(), "lab", "camera").header("camera")
    assert header.clock == clock.clock_id() == "run" != clock.own_id()
    assert header.stamp_ns - time.monotonic_ns() == pytest.approx(895 * 10**9, abs=10**9)
    assert clock.unix_offset_ns() == pytest.approx(time.time_ns() - header.stamp_ns, abs=10**9)


def test_it_does_not_go_back_when_the_offset_does() -> None:
    offset_ns = 10**9
    clock.follow("run", lambda: offset_ns)
    before_ns = clock.now_ns()
    offset_ns = 0
    assert clock.now_ns() >= before_ns
    clock.follow_none()
    assert clock.now_ns() < before_ns and clock.clock_id() == clock.own_id()

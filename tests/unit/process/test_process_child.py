"""Heartbeat block, sleep and signals of a child."""

import errno
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from groundstation.bus import clock
from groundstation.errors import GroundStationError
from groundstation.process.child import Child, ChildSpec
from groundstation.process.heartbeat import SUPERVISOR_SLOT, HeartbeatBlock, SlotState
from groundstation.process.parent import ParentWatch
from groundstation.process.signals import StopSignal

MS = 1_000_000


@pytest.fixture
def block() -> Iterator[HeartbeatBlock]:
    made = HeartbeatBlock.create(f"skein-test-{os.getpid()}-{time.monotonic_ns()}", 4)
    yield made
    made.close(remove=True)


def test_beat_is_seen_by_another_mapping(block: HeartbeatBlock) -> None:
    other = HeartbeatBlock.attach(str(block.path))
    assert other.state(2) is SlotState.EMPTY
    assert other.age_ns(2, time.monotonic_ns()) > 10**9, "a slot that never beat is old"
    block.set_state(2, SlotState.READY)
    block.beat(2)
    assert other.state(2) is SlotState.READY
    assert 0 <= other.age_ns(2, time.monotonic_ns()) < 10**9
    assert other.state(1) is SlotState.EMPTY and other.state(3) is SlotState.EMPTY
    other.clear(2)
    assert block.state(2) is SlotState.EMPTY
    other.close()


def test_a_successor_inherits_nothing_but_the_silence(block: HeartbeatBlock) -> None:
    assert not block.has_worked(2) and not block.has_ended(2) and block.pid(2) == block.beat_ns(2) == 0
    block.set_state(2, SlotState.STARTING)
    assert not block.has_worked(2)
    block.set_state(2, SlotState.DEGRADED, works=False)
    assert not block.has_worked(2)
    block.set_state(2, SlotState.DEGRADED)
    block.end(2)
    block.set_silent_since(2, 5)
    block.set_silent_since(3, 6)
    assert block.has_worked(2) and block.has_ended(2) and block.pid(2) == os.getpid() and block.beat_ns(2)
    block.clear(2)
    assert not block.has_worked(2) and not block.has_ended(2) and block.pid(2) == block.beat_ns(2) == 0
    assert (block.silent_since_ns(2), block.silent_since_ns(3)) == (5, 6)


def test_a_block_that_a_dead_run_left_is_replaced(block: HeartbeatBlock) -> None:
    block.path.write_bytes(b"")  # not even its size was set
    HeartbeatBlock.create(block.path.name, 2).close()
    made = HeartbeatBlock.create(block.path.name, 2)
    made.beat(1)
    with pytest.raises(GroundStationError, match="another run beats in"):
        HeartbeatBlock.create(block.path.name, 2)
    made.close()


def test_a_block_has_its_storage_before_anybody_beats(block: HeartbeatBlock) -> None:
    """A beat into a hole of a full /dev/shm would end the process by SIGBUS."""
    status = block.path.stat()
    assert status.st_blocks * 512 >= status.st_size > 0


def test_a_full_storage_is_reported_and_nothing_left_in_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def full(*_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", full)
    name = f"skein-test-{os.getpid()}-full"
    with pytest.raises(GroundStationError, match=f"{name}: No space left on device; make room there, or remove it"):
        HeartbeatBlock.create(name, 4)
    assert not (Path("/dev/shm") / name).exists()


def test_each_turn_beats_and_the_last_is_the_one_in_which_a_stop_came(block: HeartbeatBlock) -> None:
    with Child(ChildSpec("one", "recorder", "", "lab", str(block.path), 1)) as child:
        beats = list[int]()
        for count in child.turns(5 * MS):
            beats.append(block.beat_ns(1))
            if count == 3:
                os.kill(os.getpid(), signal.SIGTERM)
    assert len(beats) == 3 and beats == sorted(set(beats)), "a beat between each two turns"
    assert beats[2] - beats[1] >= 4 * MS


@pytest.mark.parametrize("error", [None, RuntimeError])
@pytest.mark.parametrize("finished", [True, False])
def test_only_a_driver_that_says_so_has_finished_its_work(
    block: HeartbeatBlock, error: type[Exception] | None, finished: bool
) -> None:
    spec = ChildSpec("one", "driver", "", "lab", str(block.path), 1)
    with suppress(RuntimeError), Child(spec) as child:
        child.ready()
        if finished:
            child.finish()
        if error:
            raise error
    assert block.has_ended(1) is finished and block.state(1) is SlotState.STOPPING


def test_a_child_takes_the_share_that_its_row_gives_it() -> None:
    script = (
        "import os; from groundstation.process.child import Child, ChildSpec;"
        "from groundstation.process.priority import take_share;"
        "child = Child(ChildSpec('x', 'test', '', 'lab', nice=-2)).__enter__();"
        "print(os.getpriority(os.PRIO_PROCESS, 0), take_share(-2))"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    nice, allowed = ran.stdout.split()
    assert int(nice) == (-2 if allowed == "True" else max(3, os.getpriority(os.PRIO_PROCESS, 0)))


def test_a_child_whose_block_is_gone_says_so_with_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        HeartbeatBlock.attach(str(tmp_path / "gone"))
    script = (
        "from groundstation.process.child import Child, ChildSpec;"
        f"Child(ChildSpec('one', 'tracker', '', 'lab', {str(tmp_path / 'gone')!r}, 1)).__enter__()"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert ran.stderr.splitlines()[-1].endswith(
        "/gone: No such file or directory; land, end the run and start it again"
    )


def test_death_of_the_parent_wakes_the_sleep_once() -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        parent = ParentWatch(os.getppid())
        assert parent.alive
        parent.descriptor = os.pidfd_open(process.pid)  # stand-in for a parent that can be ended here
        parent._poll.register(parent.descriptor)
        stop = StopSignal(parent)
        process.communicate(b"\n")
        assert stop.sleep_until(time.monotonic_ns() + 5000 * MS) is False
        assert not parent.alive
        began = time.monotonic_ns()
        assert stop.sleep_until(began + 30 * MS) is True
        assert time.monotonic_ns() - began >= 30 * MS, "an orphan that still lands keeps its loop rate"
        stop.close()
        parent.close()


def test_a_call_from_another_thread_ends_one_sleep() -> None:
    parent = ParentWatch()
    stop = StopSignal(parent)
    caller = threading.Timer(0.05, stop.wake)
    caller.start()
    began = time.monotonic_ns()
    assert stop.sleep_until(began + 20_000 * MS) is True
    assert time.monotonic_ns() - began < 15_000 * MS
    caller.join()
    deadline, spent = time.monotonic_ns() + 300 * MS, time.process_time()
    assert stop.sleep_until(deadline) is True
    assert time.monotonic_ns() >= deadline
    assert time.process_time() - spent < 0.1, "the call is over: it sleeps and does not spin"
    stop.close()
    parent.close()


def test_a_sleep_ends_in_time_where_the_clock_of_the_run_is_put_back() -> None:
    """A driver's loop stood still for as long as the run's host had slept."""
    parent, began_ns = ParentWatch(), time.monotonic_ns()
    stop = StopSignal(parent)
    clock.follow("run", lambda: 5000 * MS if time.monotonic_ns() < began_ns + 100 * MS else 2000 * MS)
    try:
        assert stop.sleep_until(clock.now_ns() + 200 * MS) is True
        assert 200 * MS <= time.monotonic_ns() - began_ns < 2000 * MS
    finally:
        clock.follow_none()
        stop.close()
        parent.close()


def test_stranger_as_parent_counts_as_dead() -> None:
    watch = ParentWatch(1 if os.getppid() != 1 else 2)
    assert not watch.alive
    watch.close()


def test_stop_wakes_one_sleep_only() -> None:
    kept = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    parent = ParentWatch()
    stop = StopSignal(parent)
    stop.install()
    try:
        os.kill(os.getpid(), signal.SIGINT)
        assert not stop.requested
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.requested
        assert stop.sleep_until(time.monotonic_ns() + 5000 * MS) is False
        assert stop.sleep_until(time.monotonic_ns() + 5 * MS) is True
        stop.wake()
        assert stop.sleep_until(time.monotonic_ns() + 5000 * MS) is True, "it was told to stop before, not now"
    finally:
        stop.close()
        parent.close()
        for number, handler in kept.items():
            signal.signal(number, handler)


def test_supervisor_is_fresh_only_while_it_beats(block: HeartbeatBlock) -> None:
    child = Child(ChildSpec("x", "test", "", "lab", str(block.path), 1))
    child._block = block
    assert not child.supervisor_fresh
    block.beat(SUPERVISOR_SLOT)
    assert child.supervisor_fresh
    assert Child(ChildSpec("x", "test", "", "lab")).supervisor_fresh, "without a supervisor nobody is missed"


def test_a_successor_knows_for_how_long_others_spoke_for_it() -> None:
    assert Child(ChildSpec("x", "test", "", "lab")).spoken_for_ns == 0
    since_ns = time.monotonic_ns() - 1550 * MS
    child = Child(ChildSpec("x", "test", "", "lab", spoken_since_ns=since_ns))
    assert child.spoken_for_ns == pytest.approx(1550 * MS, abs=200 * MS)


def test_process_package_imports_nothing_heavy() -> None:
    script = (
        "import sys, groundstation.process.entry, groundstation.bus.zenoh_bus;"
        "print([m for m in ('numpy', 'cv2', 'pydantic', 'scipy', 'numba', 'multiprocessing') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_child_that_ends_with_its_parent_leaves_no_orphan(number: signal.Signals) -> None:
    child = "import os, sys, time; from groundstation.process.parent import end_with; end_with(int(sys.argv[1]));"
    child += "print(os.getpid(), flush=True); time.sleep(600)"
    parent = f"import os, subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}, str(os.getpid())])"
    with subprocess.Popen([sys.executable, "-c", parent], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        watch = os.pidfd_open(int(process.stdout.readline()))
        process.send_signal(number)
        assert select.select([watch], [], [], 10.0)[0], "it outlived its parent"
        os.close(watch)


def test_a_child_whose_parent_has_ended_before_it_looked_ends_at_once() -> None:
    script = "from groundstation.process.parent import end_with; end_with(1); print('lives')"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (-signal.SIGKILL, "")

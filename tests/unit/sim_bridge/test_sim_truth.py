"""The truth board works across processes and survives readers that end."""

import os
import subprocess
import sys
import threading

import numpy as np
import pytest

from sim_bridge.truth import WIDTH, TruthBoard, remove_stale_boards


@pytest.fixture
def name() -> str:
    return f"{os.getpid()}-test"


def test_written_states_are_read_unchanged(name: str) -> None:
    board = TruthBoard.create(name, ("a", "b"))
    reader = TruthBoard.attach(name, ("a", "b"))
    states = np.arange(2.0 * WIDTH).reshape(2, WIDTH)
    board.write(42, states)
    stamp, seen = reader.read()
    assert stamp == 42
    np.testing.assert_array_equal(seen, states)
    reader.close()
    board.close()


def test_a_reader_that_exits_does_not_remove_the_board(name: str) -> None:
    board = TruthBoard.create(name, ("a",))
    board.write(7, np.ones((1, WIDTH)))
    script = f"from sim_bridge.truth import TruthBoard; print(TruthBoard.attach({name!r}, ('a',)).read()[0])"
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == "7"
        assert done.stderr == ""
    board.close()
    with pytest.raises(FileNotFoundError):
        TruthBoard.attach(name, ("a",))


def test_wrong_bodies_are_refused(name: str) -> None:
    board = TruthBoard.create(name, ("a",))
    with pytest.raises(ValueError, match="does not hold 2 bodies"):
        TruthBoard.attach(name, ("a", "b"))
    board.close()


def test_readers_never_see_half_a_state(name: str) -> None:
    board = TruthBoard.create(name, ("a", "b", "c"))
    reader = TruthBoard.attach(name, ("a", "b", "c"))
    board.write(0, np.zeros((3, WIDTH)))

    def write() -> None:
        for n in range(3000):
            board.write(n, np.full((3, WIDTH), float(n)))

    writer = threading.Thread(target=write)
    writer.start()
    while writer.is_alive():
        stamp, states = reader.read()
        assert (states == stamp).all()
    writer.join()
    reader.close()
    board.close()


def test_boards_of_dead_processes_are_swept() -> None:
    dead = TruthBoard.create("4194999-test", ("a",))
    alive = TruthBoard.create(f"{os.getpid()}-sweep", ("a",))
    remove_stale_boards()
    with pytest.raises(FileNotFoundError):
        TruthBoard.attach("4194999-test", ("a",))
    TruthBoard.attach(f"{os.getpid()}-sweep", ("a",)).close()
    dead.close()
    alive.close()

"""An experiment that is ended from outside, or a worker of it, leaves none of its simulators behind."""

import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.study]


def words_of(path: Path) -> list[str]:
    """Return the words of a file of /proc; none if its process has just ended."""
    try:
        return path.read_text().replace("\0", " ").split()
    except OSError:
        return []


def simulator_under(pid: int) -> tuple[int, int] | None:
    """Return a simulator among the descendants of a process, and its parent."""
    children = [word for task in Path(f"/proc/{pid}/task").glob("*/children") for word in words_of(task)]
    for child in map(int, children):
        if "sim_bridge.study" in words_of(Path(f"/proc/{child}/cmdline")):
            return child, pid
        if found := simulator_under(child):
            return found
    return None


@pytest.mark.parametrize(
    ("whom", "number"),
    [("command", signal.SIGTERM), ("command", signal.SIGKILL), ("worker", signal.SIGTERM)],
    ids=lambda value: str(getattr(value, "name", value)),
)
def test_no_simulator_outlives_its_experiment(whom: str, number: signal.Signals, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "groundstation", "experiment", "missions", "--flights", "20", "--workers", "1"]
    with subprocess.Popen([*command, "-o", str(tmp_path)], start_new_session=True) as process:
        try:
            found, until_s = None, time.monotonic() + 300.0
            while not (found := simulator_under(process.pid)) and time.monotonic() < until_s:
                time.sleep(0.5)
            assert found, "no simulator began"
            simulator, worker = found
            watch = os.pidfd_open(simulator)
            os.kill(process.pid if whom == "command" else worker, number)
            assert select.select([watch], [], [], 60.0)[0], "the simulator flies on"
            os.close(watch)
        finally:
            os.killpg(process.pid, signal.SIGKILL)

"""The first process of a container outlives its command, and ends when nobody is left."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

FIRST = [sys.executable, "-m", "groundstation.process.first_process"]
# The command leaves a process in a session of its own, as a supervisor does with its drivers.
LEAVES = "import subprocess, sys, os; subprocess.Popen({left}, start_new_session=True); os.kill(os.getpid(), {number})"


def test_what_a_killed_command_leaves_behind_goes_on_to_its_end(tmp_path: Path) -> None:
    done = tmp_path / "landed"
    left = [sys.executable, "-c", f"import time, pathlib; time.sleep(0.5); pathlib.Path({str(done)!r}).touch()"]
    code = LEAVES.format(left=left, number=int(signal.SIGKILL))
    ended = subprocess.run([*FIRST, sys.executable, "-c", code], timeout=20, check=False)
    assert ended.returncode == 128 + signal.SIGKILL
    assert done.exists()


def test_the_exit_code_counts_though_ends_of_children_are_ignored() -> None:
    code = "import os, signal, sys; signal.signal(signal.SIGCHLD, signal.SIG_IGN); os.execv(sys.argv[1], sys.argv[1:])"
    failing = [*FIRST, sys.executable, "-c", "raise SystemExit(7)"]
    assert subprocess.run([sys.executable, "-c", code, *failing], timeout=20, check=False).returncode == 7


def test_a_signal_reaches_the_command_whose_exit_code_counts() -> None:
    code = "import signal, sys, time; signal.signal(2, lambda *_: sys.exit(7)); print('up', flush=True); time.sleep(20)"
    with subprocess.Popen([*FIRST, sys.executable, "-c", code], stdout=subprocess.PIPE) as first:
        assert first.stdout is not None and first.stdout.readline() == b"up\n"
        os.kill(first.pid, signal.SIGINT)
        began = time.monotonic()
        assert first.wait(timeout=15) == 7 and time.monotonic() - began < 10

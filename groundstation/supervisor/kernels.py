"""Compiles kernels before a run's first process starts: beside running ones it takes several times as long."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from typing import IO

from groundstation.errors import GroundStationError
from groundstation.process import numba_cache

COMMAND = (sys.executable, "-m", "groundstation.runtime.compile_kernels")
LIMIT_S = 900.0
_TURN_S = 0.1
_NOTE_S = 15.0


def are_compiled() -> bool:
    """Return whether this checkout's kernels are in the cache that the tracker will choose."""
    return numba_cache.is_complete(numba_cache.place())


def compile_first(
    say: Callable[[str], None],
    stopped: Callable[[], bool],
    command: Sequence[str] = COMMAND,
    limit_s: float = LIMIT_S,
) -> bool:
    """Run a command that compiles all kernels, and report progress; return whether it ended before `stopped` did.

    Raises GroundStationError when it fails, takes longer than `limit_s`, or could not store its result; it is not left
    running.
    """
    numba_cache.require_writable(numba_cache.place())
    say("  compiling kernels: once per version, a minute or two")
    with tempfile.TemporaryFile() as errors:
        # A session of its own: it compiles in two processes, and both end with it.
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors, start_new_session=True
        )
        try:
            _wait_for(process, say, stopped, limit_s)
            if process.returncode:
                raise GroundStationError(f"kernels cannot be compiled: {_last_line(errors, process.returncode)}")
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    return process.returncode == 0


def _wait_for(
    process: "subprocess.Popen[bytes]", say: Callable[[str], None], stopped: Callable[[], bool], limit_s: float
) -> None:
    begin_s = note_s = time.monotonic()
    while process.poll() is None and not stopped():
        time.sleep(_TURN_S)
        now_s = time.monotonic()
        if now_s - begin_s > limit_s:
            raise GroundStationError(f"kernels are not compiled after {limit_s:.0f} s: close other programs and repeat")
        if now_s - note_s > _NOTE_S:
            note_s = now_s
            say(f"  compiling kernels: {now_s - begin_s:.0f} s so far")


def _last_line(errors: IO[bytes], code: int) -> str:
    errors.seek(0)
    lines = errors.read().decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else f"exit code {code}"

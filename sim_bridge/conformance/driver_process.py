"""The kind's driver as the supervisor would start it: a process with a section, a bus, a heartbeat and a parent."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from groundstation.process.child import ChildSpec
from groundstation.process.one_thread import one_thread
from groundstation.process.stat_file import stat_of
from groundstation.vehicles import DriverProcess

# The driver has a parent process of its own, which a check can kill.
_PARENT = (
    "import subprocess, sys\n"
    "child = subprocess.Popen(sys.argv[1:], stdout=sys.stderr)\n"
    "print(child.pid, flush=True)\n"
    "sys.exit(child.wait() & 255)\n"
)


class DriverLife:
    """One process of the driver; log: file of its standard error."""

    def __init__(self, entry: str, process: DriverProcess, spec: ChildSpec, log: Path) -> None:
        document = json.dumps(asdict(spec) | {"section": process.section}).encode()
        command = [sys.executable, "-c", _PARENT, sys.executable, "-m", "groundstation.process.entry", spec.name, entry]
        with os.fdopen(os.memfd_create("child"), "r+b") as told, log.open("ab") as errors:
            told.write(document)
            told.flush()
            told.seek(0)
            self._parent = subprocess.Popen(
                command, stdin=told, stdout=subprocess.PIPE, stderr=errors, start_new_session=True, env=one_thread()
            )
        assert self._parent.stdout is not None
        self.pid = int(self._parent.stdout.readline())
        self._watch = os.pidfd_open(self.pid)
        self.started_ns = time.monotonic_ns()

    @property
    def alive(self) -> bool:
        """Return whether the driver runs."""
        try:
            signal.pidfd_send_signal(self._watch, 0)
        except ProcessLookupError:
            return False
        fields = stat_of(self.pid)
        return fields is not None and fields[0] != "Z"

    def send(self, number: signal.Signals) -> None:
        """Send the driver a signal, if it has not ended."""
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._watch, number)

    def orphan(self) -> None:
        """Kill the driver's parent."""
        self._parent.kill()
        self._parent.wait()

    @property
    def exit_code(self) -> int | None:
        """Return the driver's exit code, which its parent passes on; None if that has not ended within 2 s."""
        with suppress(subprocess.TimeoutExpired):
            return self._parent.wait(timeout=2.0)
        return None

    def close(self) -> None:
        """End driver and parent if they still run; idempotent."""
        if self._watch < 0:
            return
        self.send(signal.SIGKILL)
        self._parent.kill()
        self._parent.wait()
        if self._parent.stdout is not None:
            self._parent.stdout.close()
        os.close(self._watch)
        self._watch = -1

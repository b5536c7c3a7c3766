"""`groundstation new --page`: the process and the address of its form."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def new_field_form(folder: Path) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """Serve the form of a field in this folder; yields the process and the address, and ends the process by Ctrl-C."""
    command = [sys.executable, "-m", "groundstation", "new", str(folder), "--page"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=dict(os.environ, PYTHONUNBUFFERED="1"))
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline().split()[1]
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.wait(10)
        process.stdout.close()

"""First process of a container: starts a command, hands on its signals, and stays until no process is left.

When the first process of a container ends, the kernel kills all others at once: a supervisor in that place would take
drivers and guardian with it, and leave its drones without anybody. `python -m groundstation.process.first_process
COMMAND...`.
"""

import ctypes
import os
import signal
import subprocess
import sys
from contextlib import suppress

_PR_SET_CHILD_SUBREAPER = 36
_HANDED_ON = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


def main(command: list[str]) -> int:
    """Return the command's exit code (128 + its signal) once it and all that it left behind have ended."""
    ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)  # orphans come here, also where this is not process 1
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # where it is ignored the exit code is lost
    started = subprocess.Popen(command)

    def hand_on(number: int, _frame: object) -> None:
        with suppress(ProcessLookupError):
            os.kill(started.pid, number)

    for number in _HANDED_ON:
        signal.signal(number, hand_on)
    return _until_alone(started.pid)


def _until_alone(command_pid: int) -> int:
    code = 0
    while True:
        try:
            pid, status = os.wait()
        except ChildProcessError:
            return code
        if pid == command_pid:
            ended = os.waitstatus_to_exitcode(status)
            code = ended if ended >= 0 else 128 - ended
            for number in _HANDED_ON:  # its pid may be another process's from now on
                signal.signal(number, signal.SIG_IGN)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

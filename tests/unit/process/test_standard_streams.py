"""Programs started without standard streams, or with an encoding that lacks characters."""

import os
import subprocess
import sys

import pytest

_OPENED = """
import os, sys
from groundstation.process.standard_streams import make_usable
make_usable()
print("for nobody", flush=True)
kept = os.dup(os.open(os.devnull, os.O_RDONLY))
os.write({report}, f"{{os.ttyname(0) if os.isatty(0) else os.readlink('/proc/self/fd/0')}} {{kept > 2}}".encode())
sys.stdin.read(1)
"""


@pytest.mark.parametrize("closed", [(0,), (1,), (2,), (0, 1, 2)])
def test_a_closed_stream_is_no_file_that_is_opened_later(closed: tuple[int, ...]) -> None:
    read, write = os.pipe()
    shut = " ".join(f"{number}{'<' if number == 0 else '>'}&-" for number in closed)
    command = ["sh", "-c", f'exec "$@" {shut}', "sh", sys.executable, "-c", _OPENED.format(report=write)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, pass_fds=(write,))
    os.close(write)
    assert (done.returncode, os.read(read, 100)) == (0, b"/dev/null True")
    os.close(read)


def test_signs_that_the_terminal_lacks_are_written_as_numbers() -> None:
    code = "from groundstation.process.standard_streams import show_all_signs as s; s(); print('4.5 cm\\u00b2 \\u2026')"
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True)
    assert done.stdout == b"4.5 cm\\xb2 \\u2026\n"

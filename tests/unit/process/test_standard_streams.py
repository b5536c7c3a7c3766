"""Programs started without standard streams, or with an encoding that lacks characters."""

import os
import pty
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


_SAID = """
import click, sys
from rich.text import Text
from groundstation.cli.terminal import show, write_over
from groundstation.process.standard_streams import make_usable, with_sequences
make_usable()
forged = "PX4: \\x1b[2J\\x1b]0;owned\\x07 \\x9b31m all is well\\r"
print(forged)
click.echo(forged)
click.echo(forged, err=True)
show(Text(forged, style="bold red"))
write_over("[###]")
"""


def test_terminals_get_no_control_characters_of_others() -> None:
    operator, terminal = pty.openpty()
    environment = os.environ | {"TERM": "xterm-256color", "COLUMNS": "200", "PYTHONIOENCODING": "utf-8"}
    environment.pop("NO_COLOR", None)
    subprocess.run([sys.executable, "-c", _SAID], stdout=terminal, stderr=terminal, env=environment, check=True)
    os.close(terminal)
    got = b""
    try:
        while more := os.read(operator, 4096):
            got += more
    except OSError:  # all was read
        os.close(operator)
    told = got.decode()
    assert told.count("PX4: \ufffd[2J\ufffd]0;owned") == 4, "shown, and not obeyed"
    assert all(sign not in told for sign in ("\x1b[2J", "\x1b]0", "\x07", "\x9b"))
    assert "\x1b[1;31m" in told and "\r\x1b[K[###]" in told, "our own are"


def test_files_get_what_was_said() -> None:
    code = "from groundstation.process.standard_streams import make_usable as m; m(); print('\\x1b[2J')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout == b"\x1b[2J\n"

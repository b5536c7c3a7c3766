"""Makes standard input and output reliable for a program, however it was started."""

import os
import sys
from contextlib import suppress
from io import TextIOWrapper


def make_usable() -> None:
    """Open closed streams, and let output escape signs that its encoding lacks; call it first in a process.

    The next opened file would get the number of a closed stream, and lines for the operator would end up in it.
    """
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        with suppress(OSError):
            os.fstat(descriptor)
            continue
        os.open(os.devnull, os.O_RDWR)  # the lowest number that is free
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(descriptor, "w" if descriptor else "r", closefd=False))
    show_all_signs()


def show_all_signs() -> None:
    """Let the terminal's output escape names and signs that it cannot show, as on stderr; that is no fault."""
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")

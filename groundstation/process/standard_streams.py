"""Standard input and output as a program may count on them, whatever started it."""

import os
import sys
from contextlib import suppress
from io import TextIOWrapper


def make_usable() -> None:
    """Open what was closed, and let the output show what its encoding cannot; first in a process.

    The number of a closed stream would go to the next file that is opened: lines for the operator would end in it.
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
    """Write a name or a sign that the terminal cannot show as Python writes it on stderr; it is no fault."""
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")

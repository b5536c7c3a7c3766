"""Makes standard input and output reliable for a program, however it was started."""

import os
import sys
from contextlib import suppress
from io import TextIOWrapper
from typing import TextIO

from groundstation.appearance.plain_text import plain


class PlainTerminal(TextIOWrapper):
    """A terminal for text without control characters; `own` takes the sequences of this program."""

    def __init__(self, own: TextIOWrapper) -> None:
        super().__init__(own.buffer, own.encoding, own.errors, line_buffering=True, write_through=True)
        self.own = own

    def write(self, text: str) -> int:
        """Write text."""
        return super().write(plain(text))


def with_sequences(stream: TextIO) -> TextIO:
    """Return the stream for this program's own control sequences, and for nothing that others have said."""
    return stream.own if isinstance(stream, PlainTerminal) else stream


def make_usable() -> None:
    """Open closed streams, keep control characters from terminals, and let output escape signs that its encoding lacks.

    Call it first in a process.

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
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, TextIOWrapper) and stream.isatty():
            setattr(sys, name, PlainTerminal(stream))


def show_all_signs() -> None:
    """Let the terminal's output escape names and signs that it cannot show, as on stderr; that is no fault."""
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")

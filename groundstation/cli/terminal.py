"""Output on a terminal: tables and drawings of rich, and a bar for long work."""

import os
import sys
from typing import TYPE_CHECKING

import click

from groundstation.appearance.plain_text import plain
from groundstation.process.standard_streams import with_sequences

if TYPE_CHECKING:
    from rich.console import RenderableType

_WHOLE = 10_000


def show(picture: "RenderableType") -> None:
    """Print a table or drawing of rich, without control characters of texts in it.

    In a pipe or a file nothing is shortened or wrapped.
    """
    from rich.console import Console
    from rich.segment import Segment, Segments

    terminal = Console(file=with_sequences(sys.stdout))
    chosen = terminal if terminal.is_terminal else Console(width=_WHOLE)
    drawn = (Segment(plain(part.text), part.style) for part in chosen.render(picture) if not part.control)
    chosen.print(Segments(drawn), end="")


def can_be_drawn_on() -> bool:
    """Return whether standard output is a terminal on which a table can be redrawn in its place."""
    return sys.stdout.isatty() and os.environ.get("TERM", "").lower() not in ("dumb", "unknown")


def progress(done: int, total: int) -> None:
    """Draw a bar of the work done, if standard error is a terminal."""
    bar = "#" * (40 * done // max(total, 1))
    write_over(f"[{bar:40}] {done}/{total}{chr(10) if done == total else ''}")


def write_over(text: str) -> None:
    """Overwrite the last line if standard error is a terminal; an empty text clears it."""
    if sys.stderr.isatty():
        click.echo(f"\r\033[K{text}", with_sequences(sys.stderr), nl=False)

"""Output on a terminal: tables and drawings of rich, and a bar for long work."""

import os
import sys
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.console import RenderableType

_WHOLE = 10_000


def show(picture: "RenderableType") -> None:
    """Print a table or drawing of rich; in a pipe or a file nothing is shortened or wrapped."""
    from rich.console import Console

    terminal = Console()
    (terminal if terminal.is_terminal else Console(width=_WHOLE)).print(picture)


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
        click.echo(f"\r\033[K{text}", err=True, nl=False)

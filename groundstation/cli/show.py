"""Prints what rich draws, on a terminal in its width and into a pipe whole."""

from rich.console import Console, RenderableType

_WHOLE = 10_000


def show(picture: RenderableType) -> None:
    """Print a picture; a pipe or a file has no width, so nothing is shortened or wrapped in it."""
    terminal = Console()
    (terminal if terminal.is_terminal else Console(width=_WHOLE)).print(picture)

"""A bar on the terminal for what takes long."""

import sys

import click


def progress(done: int, total: int) -> None:
    """Draw how much is done; nothing where nobody looks."""
    if sys.stderr.isatty():
        bar = "#" * (40 * done // max(total, 1))
        click.echo(f"\r\033[K[{bar:40}] {done}/{total}{chr(10) if done == total else ''}", err=True, nl=False)

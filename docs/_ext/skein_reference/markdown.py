"""Markdown of the generated pages: tables, and plain text made safe for MyST."""

import re
from collections.abc import Iterable, Sequence

_CODE = re.compile(r"(`[^`]*`)")
_OPTION = re.compile(r"(?<![\w-])--[a-z][\w-]*")


def prose(text: str) -> str:
    """Return a plain sentence as Markdown: code stays code, options become code, nothing else is markup."""
    parts = _CODE.split(" ".join(text.split()))
    return "".join(part if number % 2 else _escaped(part) for number, part in enumerate(parts))


def _escaped(text: str) -> str:
    text = re.sub(r"([\\*<>$\[\]|])", r"\\\1", text)
    return _OPTION.sub(lambda found: f"`{found[0]}`", text)


def code(text: object) -> str:
    """Return a text as code, also inside a table."""
    return f"`{text}`".replace("|", r"\|")


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; its cells are Markdown already."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def page(title: str, *parts: str) -> str:
    """Return a page that says of itself that it is generated."""
    note = "% Generated from the code by docs/_ext/skein_reference: edit the code, not this page."
    return "\n\n".join([note, f"# {title}", *(part.strip() for part in parts)]) + "\n"

"""Sphinx extension: writes the reference pages that come from the code, before Sphinx reads the sources.

Without Sphinx: `python -m skein_reference FOLDER`.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from skein_reference.commands import commands
from skein_reference.exit_codes import exit_codes
from skein_reference.failsafes import failsafe_page
from skein_reference.field_keys import field_keys, scenario_keys
from skein_reference.import_picture import import_picture
from skein_reference.messages import messages
from skein_reference.processes import processes

if TYPE_CHECKING:
    from sphinx.application import Sphinx

PAGES: dict[str, Callable[[], str]] = {
    "field-keys.md": field_keys,
    "scenario-keys.md": scenario_keys,
    "messages.md": messages,
    "commands.md": commands,
    "exit-codes.md": exit_codes,
    "failsafes.md": failsafe_page,
    "processes.md": processes,
    "imports.svg": import_picture,
}


def write(folder: Path) -> None:
    """Write all pages into a folder and remove what else is in it; files that would not change stay untouched."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in folder.iterdir():
        if path.name not in PAGES:
            path.unlink()
    for name, content in PAGES.items():
        path, text = folder / name, content()
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def setup(app: "Sphinx") -> dict[str, Any]:
    """Register the generator with Sphinx."""
    app.connect("builder-inited", lambda built: write(Path(built.srcdir) / "reference" / "generated"))
    return {"parallel_read_safe": True}

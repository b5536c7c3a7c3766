"""Copies shipped lenses and scenarios beside a new field file."""

import shutil
from pathlib import Path

from groundstation.errors import OperatorMistake
from groundstation.settings.files import SHIPPED


def write_field(path: Path, text: str) -> None:
    """Write a field file and, beside it, the shipped files that its folder lacks; OperatorMistake: it exists."""
    refuse_existing([path])
    for source in shipped():
        if not (target := path.parent / source.relative_to(SHIPPED)).exists():
            copy(source, target)
    path.write_text(text, encoding="utf-8")


def shipped() -> list[Path]:
    """Return the shipped lenses and scenarios; field files refer to them by relative paths."""
    return [*sorted(SHIPPED.glob("cameras/*.yaml")), *sorted(SHIPPED.glob("scenarios/*.yaml"))]


def copy(source: Path, target: Path) -> None:
    """Copy one shipped file, with its folders; if the disk is full, no partial copy remains."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        shutil.copyfile(source, target)
    except OSError:
        target.unlink(missing_ok=True)
        raise


def refuse_existing(paths: list[Path]) -> None:
    """Raise OperatorMistake if one of these files exists."""
    standing = [str(path) for path in paths if path.exists()]
    if standing:
        raise OperatorMistake(f"{standing[0]}: is there already; nothing was written; name another folder")

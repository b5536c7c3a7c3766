"""Names of the parts of a recording: `state.mcap`, `state-2.mcap`, ..., in the order they were begun; of its folder."""

import os
import re
from pathlib import Path


def part_path(folder: Path, stem: str, number: int) -> Path:
    """Return the path of a part, counted from 1."""
    return folder / (f"{stem}.mcap" if number == 1 else f"{stem}-{number}.mcap")


def shown(place: Path | str) -> str:
    """Return a path as text for files and pages, with a sign for bytes that are no UTF-8."""
    return os.fsencode(place).decode(errors="replace")


def numbered_parts(folder: Path, stem: str) -> list[tuple[int, Path]]:
    """Return (number, path) of the parts that are there, in order."""
    pattern = re.compile(rf"{re.escape(stem)}(?:-([1-9][0-9]{{0,5}}))?\.mcap")
    found = []
    for path in folder.glob(f"{stem}*.mcap"):
        matched = pattern.fullmatch(path.name)
        if matched:
            found.append((int(matched[1] or 1), path))
    return sorted(found)

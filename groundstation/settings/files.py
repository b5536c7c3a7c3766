"""Places of field files and scenarios, including those shipped with the program."""

import os
from pathlib import Path

from groundstation.errors import SettingsError

SHIPPED = Path(__file__).parent / "shipped"  # the repository's config/, in an installed package a copy of it


def find_field(name: str) -> Path:
    """Return the field file of a path, or of a shipped one's name (`lab`); raises SettingsError."""
    return _find(name, "field file", (SHIPPED,))


def find_scenario(name: str, field_file: Path) -> Path:
    """Return the scenario of a path, or of a name in `scenarios/` beside the field file or among the shipped ones."""
    return _find(name, "scenario", (field_file.parent / "scenarios", SHIPPED / "scenarios"))


def _find(name: str, what: str, folders: tuple[Path, ...]) -> Path:
    if "/" in name or name.endswith((".yaml", ".yml", ".json")):
        path = Path(name)
        _require_text(name)
        _refuse_folder(path, what)
        return path  # read() reports a missing file with the likeliest name
    known: list[str] = []
    for folder in folders:
        candidate = folder / f"{name}.yaml"
        if candidate.is_file():
            return candidate
        known += [path.stem for path in sorted(folder.glob("*.yaml"))]
    _refuse_folder(Path(name), what)
    if Path(name).is_file():
        raise SettingsError([f"{name}: is a file, but no {what}: those end in .yaml, .yml or .json"])
    from difflib import get_close_matches

    near = get_close_matches(name, known, 1, 0.5)
    meant = f"did you mean {near[0]}?" if near else f"there are: {', '.join(dict.fromkeys(known)) or 'none'}"
    raise SettingsError([f"there is no {what} {name!r}, {meant} (or give the path of a YAML file)"])


def _require_text(name: str) -> None:
    """Raise SettingsError for a path that no recording can name."""
    try:
        name.encode()
    except UnicodeEncodeError:
        raise SettingsError([f"{name!a}: this path is no UTF-8 text: rename what is not"]) from None


def _refuse_folder(path: Path, what: str) -> None:
    if path.is_dir():
        files = ", ".join(str(file) for file in sorted(path.glob("*.yaml")))
        raise SettingsError([f"{path}: is a folder, not a {what}; in it: {files or 'no .yaml file'}"])


def is_there(path: Path) -> bool:
    """Return whether a file or folder exists; a name too long for a file is none."""
    try:
        return path.exists()
    except OSError:
        return False


def unwritable(folder: Path) -> str:
    """Return why nothing can be written to a folder, which need not be there yet; "" if it can."""
    try:
        nearest = next(place for place in (folder, *folder.parents) if place.exists())
    except OSError as error:  # a name too long for a file
        return f"cannot be written: {error.strerror}"
    return (
        ""
        if nearest.is_dir() and os.access(nearest, os.W_OK)
        else f"cannot be written: {nearest} is not a folder of yours"
    )

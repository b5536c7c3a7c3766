"""A digest of the program and its plug-ins, so that results of other versions are not taken for its own."""

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from groundstation import plug_ins

if TYPE_CHECKING:
    from importlib import metadata

_PACKAGES = ("groundstation", "drivers", "sim_bridge")

PlugIn = tuple[str, str]
"""Group and name."""


def plugged_in(field: Mapping[str, Any]) -> tuple[PlugIn, ...]:
    """Return the plug-ins that a flight at message level may use by its resolved field: planner and markers."""
    planner = (field.get("planner") or {}).get("plug_in")
    markers = sorted(set(_dictionaries(field)))
    return (*((plug_ins.PLANNERS, name) for name in [planner] if name), *((plug_ins.MARKERS, one) for one in markers))


def _dictionaries(part: Any) -> Iterator[str]:
    if isinstance(part, Mapping):
        for name, value in part.items():
            if name == "dictionary" and isinstance(value, str):
                yield value
            else:
                yield from _dictionaries(value)
    elif isinstance(part, list | tuple):
        for one in part:
            yield from _dictionaries(one)


@cache
def program_digest(used: tuple[PlugIn, ...] = ()) -> str:
    """Return a digest of all sources and data of the product's packages, and of the packages of these plug-ins.

    A plug-in counts with its package's version and modules; what these import from other packages does not count.
    """
    digest = hashlib.sha256()
    _take(digest, _PACKAGES)
    for group, name in used:
        for known, source, entry in plug_ins.entries(group):
            if known == name:
                version = entry.dist.version if entry.dist is not None else ""
                digest.update(f"{group} {name} {source} {version}".encode() + b"\0")
                _take(digest, sorted({entry.module.partition(".")[0], *_modules(entry.dist)}))
    return digest.hexdigest()


def _take(digest: "hashlib._Hash", modules: tuple[str, ...] | list[str]) -> None:
    """Add all files of top-level modules and packages, which are not imported."""
    for module in modules:
        spec = None
        with suppress(ImportError, ValueError):
            spec = find_spec(module)
        if spec is None:
            continue
        for folder in sorted(map(Path, spec.submodule_search_locations or ())):
            for path in sorted(one for one in folder.rglob("*") if one.is_file() and "__pycache__" not in one.parts):
                digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
        if not spec.submodule_search_locations and spec.has_location and spec.origin:
            digest.update(module.encode() + b"\0" + Path(spec.origin).read_bytes())


def _modules(package: "metadata.Distribution | None") -> Iterator[str]:
    """Yield the top-level modules that a package lists; one that is installed in place need not list any."""
    if package is None:
        return
    yield from (package.read_text("top_level.txt") or "").split()
    for file in package.files or ():
        if file.suffix == ".py" and (top := file.parts[0].removesuffix(".py")).isidentifier():
            yield top

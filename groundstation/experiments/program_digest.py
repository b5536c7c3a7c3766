"""A digest of the program, so that results of another version are not taken for its own."""

import hashlib
from functools import cache
from importlib.util import find_spec
from pathlib import Path

_PACKAGES = ("groundstation", "drivers", "sim_bridge")


@cache
def program_digest() -> str:
    """Return a digest of all sources and data of the product's packages."""
    digest = hashlib.sha256()
    for package in _PACKAGES:
        spec = find_spec(package)
        for folder in sorted(map(Path, (spec.submodule_search_locations if spec else None) or ())):
            for path in sorted(one for one in folder.rglob("*") if one.is_file() and "__pycache__" not in one.parts):
                digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()

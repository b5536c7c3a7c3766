"""Where numba keeps compiled kernels: a directory per state of all kernel sources.

numba does not notice an edited callee or constant in another module, so a cache that outlives an edit is wrong.
"""

import hashlib
import os
import sys
from importlib.metadata import version
from pathlib import Path

_PACKAGES = ("estimation", "experiments", "geometry", "planning", "sensing")


def sources_hash() -> str:
    """Return a short hash of all sources that kernels are built from, and of the versions that build them."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256(f"{sys.version}/{version('numba')}/{version('numpy')}".encode())
    for package in _PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def activate() -> Path:
    """Point numba to this state's cache and return it; call it before numba is imported.

    A NUMBA_CACHE_DIR that somebody has set already is respected.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(chosen)
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "skein" / f"numba-{sources_hash()}"
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    return folder

"""Where numba keeps compiled kernels: a directory per state of all kernel sources.

numba does not notice an edited callee or constant in another module, so a cache that outlives an edit is wrong.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from groundstation.errors import GroundStationError

FLIGHT = (".", "estimation", "estimation/models", "geometry", "planning", "sensing")
"""Packages whose kernels fly."""

EVERYTHING = (*FLIGHT, "experiments", "experiments/planar", "bench", "bench/planner_peers")

_KEPT = 24  # directories of older states that are not deleted
_COMPILE_LIMIT_S = 180.0


def sources_hash(packages: Iterable[str] = FLIGHT) -> str:
    """Return a short hash of the sources that kernels are built from, and of the versions that build them."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256(f"{sys.version}/{version('numba')}/{version('numpy')}".encode())
    for package in packages:
        for path in sorted((root / package).glob("*.py")):
            digest.update(str(path.relative_to(root)).encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def place(packages: Iterable[str] = FLIGHT) -> Path:
    """Return the cache of these packages' state; a NUMBA_CACHE_DIR that somebody has set is respected."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "skein"
    return Path(chosen) if chosen else base / f"numba-{sources_hash(packages)}"


def activate(packages: Iterable[str] = FLIGHT) -> Path:
    """Point numba to the cache of these packages' state and return it; call it before numba is imported."""
    folder = place(packages)
    if not os.environ.get("NUMBA_CACHE_DIR"):
        os.environ["NUMBA_CACHE_DIR"] = str(folder)
        if not folder.exists():
            _forget_old(folder.parent)
            _begin_with(folder.parent / f"numba-{sources_hash(FLIGHT)}", folder)
    return folder


def require_writable(folder: Path) -> None:
    """Raise GroundStationError where nothing can be kept: each start would compile for minutes, silently."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        remedy = "let NUMBA_CACHE_DIR name a folder that can be written"
        raise GroundStationError(f"compiled kernels cannot be kept in {folder} ({error.strerror}): {remedy}") from error


def is_complete(folder: Path) -> bool:
    """Return whether this checkout's flying kernels are all in a cache that `activate` returned."""
    return _mark(folder).exists()


def mark_complete(folder: Path) -> None:
    """Record that they all are: the folder alone may be another checkout's, or half filled by a stopped compilation."""
    with suppress(OSError):  # then it is looked through once more next time
        folder.mkdir(parents=True, exist_ok=True)
        _mark(folder).touch()


def _mark(folder: Path) -> Path:
    checkout = hashlib.sha256(bytes(Path(__file__).parents[1])).hexdigest()[:16]  # numba's keys include the path
    return folder / f"complete-{checkout}"


def _begin_with(flying: Path, folder: Path) -> None:
    """Let a cache of more packages begin with the kernels that fly, where those are compiled: it saves a minute."""
    if flying == folder or not flying.is_dir():
        return
    copy = folder.with_name(f"{folder.name}.{os.getpid()}")
    try:
        shutil.copytree(flying, copy)
        copy.rename(folder)
    except (OSError, shutil.Error):  # another process was first, or the disk is full: missing kernels are compiled
        shutil.rmtree(copy, ignore_errors=True)


def _forget_old(base: Path) -> None:
    with suppress(OSError):  # another process may be tidying as well
        folders = sorted(base.glob("numba-*"), key=lambda path: path.stat().st_mtime, reverse=True)
        for folder in folders[_KEPT:]:
            shutil.rmtree(folder, ignore_errors=True)


class ParallelCompilation:
    """Compiles the kernels that some modules import in a process of its own, while this one compiles others."""

    def __init__(self, modules: Iterable[str]) -> None:
        statement = "\n".join(f"import {module}" for module in modules)
        self._process = subprocess.Popen([sys.executable, "-c", statement], stdin=subprocess.DEVNULL)

    def finish(self) -> bool:
        """Wait for it; returns whether it compiled all. The remaining kernels are compiled where they are imported."""
        try:
            return self._process.wait(_COMPILE_LIMIT_S) == 0
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            return False

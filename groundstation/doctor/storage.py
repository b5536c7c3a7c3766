"""Checks of the recordings' disk (free space, speed), of memory and open files."""

import os
import resource
import time
from contextlib import suppress
from pathlib import Path

from groundstation.doctor.finding import Finding, Level, judged
from groundstation.recording.disk_space import free_bytes

# A flight writes about 2.9 GB an hour with pictures.
_FREE_MUST, _FREE_SHOULD = 1e9, 5e9
_SPEED_SHOULD = 20e6
_MEMORY_SHOULD = 4e9
_FILES_SHOULD = 1024
_BLOCK, _BLOCKS = 1 << 20, 16
_REMEDY = "set recording.directory to a folder of yours"


def room(folder: Path) -> Finding:
    """Return a finding on the free space of the recordings' folder, or of its nearest existing parent."""
    taken = _present(folder)[0]
    if not taken.is_dir():
        return Finding(Level.MUST, "disk", f"{taken} is no folder: nothing can be recorded there", _REMEDY)
    try:
        free = free_bytes(_nearest(folder))
    except OSError as error:
        return Finding(Level.MUST, "disk", f"{folder}: {error.strerror}", _REMEDY)
    level = Level.MUST if free < _FREE_MUST else Level.SHOULD
    found = f"{free / 1e9:.1f} GB free for {folder}"
    remedy = "make room, or set recording.directory: a flight writes about 3 GB an hour"
    return judged(free >= _FREE_SHOULD, level, "disk", found, remedy)


def speed(folder: Path) -> Finding:
    """Return a finding on the speed of the disk, by 16 MB written beside the recordings and removed again."""
    path = _nearest(folder) / f".skein-doctor-{os.getpid()}"
    try:
        took_s = _write(path)
    except OSError as error:
        return Finding(Level.MUST, "disk speed", f"cannot write to {path.parent}: {error.strerror}", _REMEDY)
    rate = _BLOCK * _BLOCKS / max(took_s, 1e-6)
    found = f"{rate / 1e6:.0f} MB/s"
    return judged(
        rate >= _SPEED_SHOULD, Level.SHOULD, "disk speed", found, "record to a local disk, not to a network's"
    )


def _write(path: Path) -> float:
    began = time.monotonic()
    try:
        with path.open("wb") as file:
            for _ in range(_BLOCKS):
                file.write(b"\0" * _BLOCK)
            file.flush()
            os.fsync(file.fileno())
        return time.monotonic() - began
    finally:
        with suppress(OSError):
            path.unlink()


def _present(folder: Path) -> list[Path]:
    """Return the folder and its parents, nearest first, without those that would have to be made."""
    folder = folder.absolute()
    return [place for place in (folder, *folder.parents) if os.path.lexists(place)]


def _nearest(folder: Path) -> Path:
    return next(place for place in _present(folder) if place.is_dir())


def memory() -> Finding:
    """Return a finding on the machine's memory."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return judged(
        total >= _MEMORY_SHOULD, Level.SHOULD, "memory", f"{total / 1e9:.1f} GB", "4 GB are needed with cameras"
    )


def open_files() -> Finding:
    """Return a finding on the number of files that a process may hold open."""
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    unlimited = soft == resource.RLIM_INFINITY
    found = "unlimited" if unlimited else f"{soft}"
    return judged(unlimited or soft >= _FILES_SHOULD, Level.SHOULD, "open files", found, "ulimit -n 4096")

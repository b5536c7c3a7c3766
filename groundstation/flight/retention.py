"""Removes the oldest recorded runs once they take more space than the field allows."""

import re
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from groundstation.recording.file_topics import STATE
from groundstation.recording.part_names import part_path
from groundstation.recording.stretch import is_stretch

KEEP = "KEEP"
# Folders of `make_run_dir`: nothing else in the folder of runs is ever touched.
_NAME = re.compile(r"\d{8}T\d{6}Z-.+")
_SETTLED_S = 120.0


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """A run folder: its size [bytes], and when its newest file was written [UNIX s]."""

    folder: Path
    size: int
    written_s: float


def make_room(parent: Path, limit_gb: float, now_s: float | None = None) -> list[RecordedRun]:
    """Remove the oldest runs until the rest takes at most `limit_gb` [GB]; return those removed. 0: keeps all.

    A run with a file named KEEP stays, and so does one written to within the last two minutes: it may still fly. A
    folder that cannot be removed stays, and the next older one is removed in its place.
    """
    runs = sorted(_runs(parent), key=lambda run: run.folder.name) if limit_gb > 0 else []
    excess = sum(run.size for run in runs) - limit_gb * 1e9
    now_s = time.time() if now_s is None else now_s
    removed = []
    for run in runs:
        if excess <= 0:
            break
        if (run.folder / KEEP).exists() or now_s - run.written_s < _SETTLED_S:
            continue
        try:
            shutil.rmtree(run.folder)
        except OSError:
            continue
        excess -= run.size
        removed.append(run)
    return removed


def _runs(parent: Path) -> Iterator[RecordedRun]:
    for folder in parent.iterdir() if parent.is_dir() else ():
        if _NAME.fullmatch(folder.name) and folder.is_dir() and not folder.is_symlink():
            if is_stretch(part_path(folder, STATE, 1)):
                continue  # a person chose its contents
            try:
                status = [path.lstat() for path in (folder, *folder.rglob("*"))]
            except OSError:  # another flight is removing it
                continue
            newest_s = max(one.st_mtime for one in status[1:] or status)
            yield RecordedRun(folder, sum(one.st_size for one in status[1:]), newest_s)

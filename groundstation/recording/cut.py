"""Cuts a stretch of a run out as a new run: a folder from a folder, a file from a file."""

import shutil
from pathlib import Path

from groundstation.recording.compatibility import RecordingError
from groundstation.recording.copies import cut
from groundstation.recording.outputs import new_folder, require_absent
from groundstation.recording.run import RecordedRun
from groundstation.time_units import NS_PER_S

# Files that reports and replays need beside those of a run.
_COMPANIONS = ("run.json", "resolved.yaml")


def cut_run(run: RecordedRun, path: Path, from_s: float, to_s: float | None, output: Path | None) -> dict[Path, int]:
    """Write a run's messages between two times [s since the start]; returns the new files with their message counts.

    path: where the run was opened. Afterwards `run.damage` names unreadable parts. Raises RecordingError if nothing
    lies between them or the output exists; leaves no partial output.
    """
    end_s = run.duration_s if to_s is None else to_s
    if not from_s < end_s:
        raise RecordingError(f"--from {from_s:g} is not before --to {end_s:g}")
    if from_s >= run.duration_s:
        raise RecordingError(f"{path}: lasts {run.duration_s:.1f} s, nothing begins at {from_s:g} s")
    from_ns = run.start_ns + round(from_s * NS_PER_S)
    until_ns = run.end_ns + 1 if to_s is None else run.start_ns + round(to_s * NS_PER_S)
    place = path.resolve() if path.name in ("", "..") else path.absolute()
    name = f"{place.name.removesuffix('.mcap')}-{from_s:g}s-{end_s:.6g}s"
    target = output or place.with_name(f"{name}.mcap" if path.is_file() else name)
    require_absent(target)
    if path.is_file():
        return {target: cut(run, run.indexes[0].stem, from_ns, until_ns, target)}
    with new_folder(target):
        written = _cut_stems(run, from_ns, until_ns, target)
        for name in _COMPANIONS:
            if (path / name).is_file():
                shutil.copy(path / name, target / name)
    return written


def _cut_stems(run: RecordedRun, from_ns: int, until_ns: int, target: Path) -> dict[Path, int]:
    stems = dict.fromkeys(index.stem for index in run.indexes)
    return {target / f"{stem}.mcap": cut(run, stem, from_ns, until_ns, target / f"{stem}.mcap") for stem in stems}

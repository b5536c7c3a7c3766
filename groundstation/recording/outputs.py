"""Safe output: never overwrites, never leaves partial results, and errors name the place."""

import errno
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from groundstation.errors import GroundStationError, OperatorMistake, is_wrong_place
from groundstation.recording.compatibility import RecordingError

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class OutputError(GroundStationError):
    """The disk is full, or failed."""


def require_absent(path: Path) -> None:
    """Raise RecordingError when a path to write exists already."""
    if path.exists() or path.is_symlink():
        raise RecordingError(f"{path}: exists already; name another place with --output")


@contextmanager
def errors_named(path: Path) -> Iterator[None]:
    """Name place and remedy of an error of the disk: an OperatorMistake for a wrong place, else an OutputError."""
    try:
        yield
    except OSError as error:
        if is_wrong_place(error):
            raise OperatorMistake(f"{path}: {error.strerror}; name another place") from error
        remedy = ": make room, or name another place" if error.errno in _NO_ROOM else ""
        raise OutputError(f"{path}: {error.strerror or error}{remedy}") from error


@contextmanager
def replaced_file(path: Path) -> Iterator[Path]:
    """Yield the path to write to; it replaces `path` when all went well."""
    partial = path.with_name(f".partial-{path.name}")  # many libraries go by the file name's ending
    with errors_named(path):
        try:
            yield partial
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


@contextmanager
def new_folder(path: Path) -> Iterator[None]:
    """Make a folder to be filled; it is removed again on failure.

    Raises OperatorMistake when there is something already or nothing can be, OutputError when the disk refuses.
    """
    require_absent(path)
    with errors_named(path):
        path.mkdir(parents=True)
        with removed_if_unfinished(path):
            yield


@contextmanager
def unmade_folder(path: Path) -> Iterator[None]:
    """Do the same for a folder made by a library that refuses an existing one."""
    require_absent(path)
    with errors_named(path), removed_if_unfinished(path):
        yield


@contextmanager
def removed_if_unfinished(path: Path) -> Iterator[None]:
    """Remove a folder, if it exists by then, when filling it fails or is interrupted."""
    try:
        yield
    except BaseException:
        shutil.rmtree(path, ignore_errors=True)
        raise


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Yield the path to write to; it becomes `path` when all went well, and is removed otherwise.

    Raises OperatorMistake when there is something already or nothing can be, OutputError when the disk refuses.
    """
    require_absent(path)
    with replaced_file(path) as partial:
        yield partial
        require_absent(path)

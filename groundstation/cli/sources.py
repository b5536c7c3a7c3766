"""The shared part of commands that look through a camera: its address, its lens, their output folder."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.errors import OperatorMistake, without_password

if TYPE_CHECKING:
    from drivers.camera.calibration.feed import SourcePicture
    from groundstation.geometry.lens import CameraIntrinsics


def _forms() -> str:
    from groundstation.vehicles import all_kinds

    schemes = ["http", "rtsp", *(kind.camera for kind in all_kinds().values() if kind.camera)]
    return ", ".join([*(f"{scheme}://..." for scheme in schemes), "/dev/video0, a video file, or a folder of pictures"])


def source_of(_context: click.Context, _parameter: click.Parameter, value: str) -> str:
    """Return a camera source; a file or folder may be given relative. Raises BadParameter for anything else."""
    from drivers.camera.source_address import parse_source

    path = Path(value)
    if "://" not in value and not value.startswith("/dev/"):
        if not path.exists():
            raise click.BadParameter(f"{without_password(value)!r} is no file or folder here, nor {_forms()}.")
        return str(path.resolve())
    try:
        parse_source(value)
    except ValueError as error:
        raise click.BadParameter(f"{without_password(value)!r} {error}") from None
    return value


def lens_of(path: Path) -> "CameraIntrinsics":
    """Return the lens of a calibration file; raises SettingsError with its mistakes."""
    from groundstation.geometry.lens import intrinsics_of
    from groundstation.settings.calibration_file import load_calibration

    return intrinsics_of(load_calibration(path))


def require_size(shot: "SourcePicture", lens: "CameraIntrinsics", calibration: str) -> None:
    """Raise OperatorMistake if a picture's size is not that of its calibration."""
    if shot.size != (lens.width_px, lens.height_px):
        width, height = shot.size
        raise OperatorMistake(
            f"its pictures are {width}x{height}, the calibration {calibration} is for {lens.width_px}x"
            f"{lens.height_px}: set the camera to that size, or calibrate it at this one"
        )


def require_folder(folder: Path) -> None:
    """Make an output folder; raises OperatorMistake if nothing can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OperatorMistake(f"{folder}: cannot be made or written ({error.strerror})") from None
    if not os.access(folder, os.W_OK):
        raise OperatorMistake(f"{folder}: cannot be written")


@contextmanager
def until_interrupted() -> Iterator[None]:
    """Let Ctrl-C end the block, not the command."""
    with suppress(KeyboardInterrupt):
        yield

"""`groundstation camera view`: shows a camera's pictures with the detector's findings, without flying."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.numbers import FiniteRange
from groundstation.cli.sources import lens_of, require_folder, require_size, source_of, until_interrupted

if TYPE_CHECKING:
    from drivers.camera.calibration.preview import Look

_PORT = 8770
_TAG_MM = 168.0


def _known(_context: click.Context, _parameter: click.Parameter, value: str) -> tuple[str, ...]:
    from groundstation.geometry.tag import tag_fault

    names = tuple(dict.fromkeys(name for name in value.split(",") if name))
    for name in names:
        if fault := tag_fault(name, 0):
            raise click.BadParameter(fault)
    return names


@click.group(epilog="Example: groundstation camera view http://192.168.1.50:8080/video.mjpg --stream")
def camera() -> None:
    """Show what cameras see."""


@camera.command(
    epilog="\b\nExamples:\n  groundstation camera view /dev/video0 --calibration config/cameras/ceiling.yaml --stream\n"
    "  groundstation camera view rtsp://192.168.1.60/front -o seen/ --frames 50\n"
    "  groundstation camera view pictures/ --calibration config/cameras/ceiling.yaml -o seen/\n"
    "  groundstation camera view /dev/video0 --dictionary DICT_APRILTAG_36H11 --stream\n\n"
    "Exit codes: 0 done, 2 wrong usage, or pictures of another size than the calibration, 4 no pictures."
)
@click.argument("source", callback=source_of)
@click.option(
    "--calibration",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="The camera's calibration; without it markers have no distance.",
)
@click.option("--square-mm", type=FiniteRange(5, 200), default=44.0, show_default=True, help="Side of a square.")
@click.option(
    "--dictionary",
    "dictionaries",
    metavar="NAMES",
    default="",
    callback=_known,
    help="Find tags of these ArUco, AprilTag or plug-ins' dictionaries, too; NAME,NAME.",
)
@click.option("--size-mm", type=FiniteRange(10, 1000), help=f"Side of a tag's black square.  [default: {_TAG_MM:g}]")
@click.option("-o", "--output", type=click.Path(path_type=Path, file_okay=False), help="Write annotated pictures here.")
@click.option("--stream", is_flag=True, help="Serve them as MJPEG on loopback, for a browser.")
@click.option(
    "--port", type=click.IntRange(0, 65535), default=_PORT, show_default=True, help="Port to serve on; 0: any free one."
)
@click.option("--frames", type=click.IntRange(1), help="End after this many pictures.")
def view(source: str, calibration: Path | None, output: Path | None, port: int, **options: Any) -> int:
    """Find markers in the pictures of SOURCE; list, draw and show them. Ctrl-C ends it.

    Each picture of a folder is searched all over, those of cameras and video files as often as in flight.

    Drawn are corners (a ring on the first), axes, code or id, distance, residual, age, and the windows searched.
    """
    from drivers.camera.calibration.annotate import jpeg_of, save
    from drivers.camera.calibration.feed import shots
    from drivers.camera.calibration.preview import DetectorPreview
    from drivers.camera.calibration.stream import PictureServer

    if options["size_mm"] is not None and not options["dictionaries"]:
        raise click.UsageError("--size-mm: belongs to tags (--dictionary); squares have --square-mm")
    tags = options["dictionaries"], options["size_mm"] or _TAG_MM
    lens = lens_of(calibration) if calibration is not None else None
    if output is not None:
        require_folder(output)
    served = PictureServer(port) if options["stream"] else None
    if served is not None:
        click.echo(f"{served.url} (Ctrl-C ends it)")
    viewer, seen = None, PictureCounter()
    try:
        with until_interrupted():
            for shot in shots(source, None if lens is None else (lens.width_px, lens.height_px)):
                if lens is not None:
                    require_size(shot, lens, str(calibration))
                viewer = viewer or DetectorPreview(shot.size, lens, options["square_mm"], *tags, each=shot.alone)
                look = viewer.look(shot)
                seen.add(look)
                if output is not None:
                    save(output, shot.name, look.picture)
                if served is not None:
                    served.show(jpeg_of(look.picture))
                if seen.pictures == options["frames"]:
                    break
    finally:
        if served is not None:
            served.close()
    click.echo(seen.text)
    return ExitCode.OK


class PictureCounter:
    """Prints a line for each picture, and counts."""

    def __init__(self) -> None:
        self.pictures, self._found, self._cpu_ms = 0, 0, 0.0

    def add(self, look: "Look") -> None:
        """Take a picture's result."""
        click.echo(look.text)
        self.pictures += 1
        self._found += bool(look.marked)
        self._cpu_ms += look.cpu_ms

    @property
    def text(self) -> str:
        """Return a summary of all pictures."""
        mean_ms = self._cpu_ms / max(1, self.pictures)
        return f"{self.pictures} pictures, markers in {self._found} of them, {mean_ms:.1f} ms of CPU each"

"""`groundstation calibrate camera`: a lens from pictures of a board."""

import datetime
import re
import shutil
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.sources import require_folder, source_of, until_interrupted
from groundstation.errors import OperatorMistake

if TYPE_CHECKING:
    from drivers.camera.calibration.feed import SourcePicture
    from drivers.camera.calibration.lens_fit import LensFit
    from drivers.camera.calibration.pattern import Pattern
    from drivers.camera.calibration.view_quality import Flaw, Judge

_NAME = r"[a-z][a-z0-9_]{0,47}"
_FOLDER = Path("config/cameras")
_SHOWN_MISSING = 3


@click.command(
    epilog="\b\nExamples:\n"
    "  groundstation calibrate camera http://192.168.1.50:8080/video.mjpg -o my_lab/cameras/ceiling.yaml --force\n"
    "  groundstation calibrate camera rtsp://192.168.1.60/ --board skein --square-mm 44 -o my_lab/cameras/front.yaml\n"
    "  groundstation calibrate camera pictures/ --board 9x6 -o my_lab/cameras/ceiling.yaml --judged\n\n"
    "Show the board in every part of the picture, near and far, tilted to all sides, and hold still for each view.\n\n"
    "Exit codes: 0 written, 2 wrong usage, 4 no pictures or no lens can be fitted."
)
@click.argument("source", callback=source_of)
@click.option("--board", default="9x6", show_default=True, help="Inner corners along its sides, or skein: a marker.")
@click.option("--square-mm", type=float, default=25.0, show_default=True, help="Side of a square.")
@click.option("--name", default="camera", show_default=True, help="Name of the camera; NAME.yaml is written.")
@click.option("--views", type=click.IntRange(6, 200), default=20, show_default=True, help="Views to collect.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help=f"File to write.  [default: {_FOLDER}/NAME.yaml]")
@click.option("--judged", is_flag=True, help="Write the judged pictures beside it, into the folder NAME-judged.")
@click.option("--force", is_flag=True, help="Overwrite an existing calibration.")
@click.option(
    "--recipe",
    type=click.Choice(["skein", "opencv"]),
    default="skein",
    show_default=True,
    help="opencv: as its samples do, to compare with published figures: all views, a fixed corner window, fx = fy.",
)
def camera(source: str, board: str, square_mm: float, recipe: str, **options: Any) -> int:
    """Measure the lens of the camera at SOURCE and write its calibration.

    SOURCE: http://..., rtsp://..., ardrone://..., /dev/video0, a video file, or a folder of pictures. Ctrl-C ends the
    looking; the views until then are used.
    """
    from drivers.camera.calibration.pattern import pattern_of

    if re.fullmatch(_NAME, options["name"]) is None:
        raise click.UsageError(f"--name {options['name']}: must be of small letters, digits and _, a letter first")
    output = _require_output(options["output"] or _FOLDER / f"{options['name']}.yaml", options["force"])
    judged = output.with_name(f"{output.stem}-judged") if options["judged"] else None
    if judged is not None:
        require_folder(judged)
    try:
        pattern = pattern_of(board, square_mm, as_opencv=recipe == "opencv")
    except ValueError as error:
        raise click.UsageError(f"--board: {error}") from None
    session = CalibrationSession(pattern, options["views"], judged)
    session.watch(source)
    fit = session.fit(as_opencv=recipe == "opencv")
    _write(output, source, session, fit)
    return ExitCode.OK


def _require_output(path: Path, force: bool) -> Path:
    if path.exists() and not force:
        raise OperatorMistake(f"{path}: is there already; --force overwrites it, --name or --output give another")
    if path.is_dir():
        raise OperatorMistake(f"{path}: is a folder")
    require_folder(path.parent)
    return path


class CalibrationSession:
    """Collects views of one source until they suffice; reports the views that are still missing."""

    def __init__(self, pattern: "Pattern", enough: int, judged: Path | None) -> None:
        self._pattern, self._enough, self._judged = pattern, enough, judged
        self._judge: Judge | None = None
        self._size = (0, 0)
        self._screen = ProgressLine()

    def watch(self, source: str) -> None:
        """Look until the views suffice, the source ends, or Ctrl-C."""
        from drivers.camera.calibration.feed import shots

        with until_interrupted():
            for shot in shots(source):
                self._take(shot)
                if self._is_enough:
                    break
        self._screen.end()

    @property
    def judge(self) -> "Judge":
        """Return the judge with its views of all pictures; raises OperatorMistake without any picture."""
        if self._judge is None:
            raise OperatorMistake("no picture was looked at: nothing was written")
        return self._judge

    @property
    def missing(self) -> tuple[str, ...]:
        """Return the views that are still missing."""
        from drivers.camera.calibration.coverage import coverage_of

        return coverage_of(self.judge.views, self._pattern, self._size).missing

    @property
    def _is_enough(self) -> bool:
        return len(self.judge.views) >= self._enough and not self.missing

    def _take(self, shot: "SourcePicture") -> None:
        from drivers.camera.calibration.view_quality import Judge

        if self._judge is None:
            self._judge, self._size = Judge(self._pattern, shot.size), shot.size
        if shot.size != self._size:
            now, before = (f"{width}x{height}" for width, height in (shot.size, self._size))
            raise OperatorMistake(f"picture {shot.name} is {now}, those before were {before}: a lens has one size")
        flaw, corners = self._judge.look(shot.name, shot.grey)
        self._screen.show(shot.name, flaw, len(self._judge.views), self._enough, self.missing)
        if self._judged is not None:
            self._save(shot, flaw, corners)

    def _save(self, shot: "SourcePicture", flaw: "Flaw | None", corners: Any) -> None:
        from drivers.camera.calibration import annotate

        assert self._judged is not None
        drawn, colour = annotate.canvas(shot.grey), annotate.BAD if flaw else annotate.GOOD
        if corners is not None:
            annotate.dots(drawn, corners, colour)
        annotate.lines(drawn, [f"{shot.name}: {flaw or 'kept'}"], colour)
        annotate.save(self._judged, shot.name, drawn)

    def fit(self, as_opencv: bool) -> "LensFit":
        """Return the lens of the views; raises OperatorMistake when there are too few, with what to do."""
        from drivers.camera.calibration.lens_fit import LEAST_VIEWS, fit_lens

        judge = self.judge
        if len(judge.views) < LEAST_VIEWS:
            raise OperatorMistake(self._too_few(LEAST_VIEWS))
        fit = fit_lens(judge.views, self._pattern, self._size, keep_all=as_opencv, square_pixels=as_opencv)
        self._report(fit)
        return fit

    def _too_few(self, least: int) -> str:
        judge, count = self.judge, len(self.judge.views)
        reasons = ", ".join(f"{number} x {flaw}" for flaw, number in judge.flaws.most_common()) or "no more came"
        other = judge.other_board
        if other:
            hint = f"the pictures seem to show a board with {other} inner corners: --board {other}?"
        elif not count:
            hint = (
                f"no {self._pattern.label} was found: is --board its number of INNER corners, is all of it in the "
                "picture, flat and well lit?"
            )
        else:
            hint = "show the board in more places of the picture, and hold still"
        return f"{count} usable view(s), at least {least} are needed ({reasons}); {hint}"

    def _report(self, fit: "LensFit") -> None:
        from groundstation.geometry.lens import MOST_RESIDUAL_PX

        lens, std = fit.lens, fit.std
        refused = ", ".join(f"{number} x {flaw}" for flaw, number in self.judge.flaws.most_common())
        lines = [
            f"{len(fit.by_view_px)} views of {self._size[0]}x{self._size[1]}"
            + (f"; not kept: {refused}" * bool(refused)),
            f"fx {lens.fx_px:.2f} +- {std['fx_px']:.2f}   fy {lens.fy_px:.2f} +- {std['fy_px']:.2f}   "
            f"cx {lens.cx_px:.2f} +- {std['cx_px']:.2f}   cy {lens.cy_px:.2f} +- {std['cy_px']:.2f} px",
            f"rms {lens.residual_px:.3f} px; worst view {max(fit.by_view_px, key=fit.by_view_px.__getitem__)} "
            f"({max(fit.by_view_px.values()):.2f} px)",
        ]
        if lens.residual_px > MOST_RESIDUAL_PX:
            lines.append(
                f"fits badly (usual are 0.2 px, at most {MOST_RESIDUAL_PX:g}): distances would be off by 1 % and more; "
                "is the board flat, was it held still, and is the lens no fisheye?"
            )
        if fit.dropped:
            names = ", ".join(f"{name} ({rms:.2f} px)" for name, rms in fit.dropped.items())
            lines.append(f"dropped, they fit no lens: {names}; with them the rms were {fit.all_views_px:.3f} px")
        if self.missing:
            lines.append(f"not covered, so less well known there: {', '.join(self.missing)}")
        click.echo("\n".join(lines))


class ProgressLine:
    """Reports every picture on stderr: on a terminal one line that changes, else one line each that was kept."""

    def __init__(self) -> None:
        self._stream = sys.stderr
        self._live = self._stream.isatty()
        self._told_s = 0.0

    def show(self, name: str, flaw: "Flaw | None", count: int, enough: int, missing: tuple[str, ...]) -> None:
        """Report the result of a picture, and the views that are missing now."""
        verdict = str(flaw) if flaw is not None else "kept"
        wanted = ", ".join(missing[:_SHOWN_MISSING]) + (
            f" and {len(missing) - _SHOWN_MISSING} more" * (len(missing) > 3)
        )
        line = f"{count}/{enough} views   {name}: {verdict}   still missing: {wanted or 'nothing'}"
        if self._live:
            width = shutil.get_terminal_size().columns - 1
            self._stream.write(f"\r{line[:width]:{width}}")
            self._stream.flush()
        elif flaw is None or time.monotonic() - self._told_s > 1.0:
            self._told_s = time.monotonic()
            click.echo(line, err=True)

    def end(self) -> None:
        """Leave the line."""
        if self._live:
            click.echo("", err=True)


def _write(output: Path, source: str, session: CalibrationSession, fit: "LensFit") -> None:
    from groundstation.errors import without_password
    from groundstation.recording.outputs import replaced_file
    from groundstation.settings.calibration_file import calibration_text

    missing = session.missing
    remark = f"measured by groundstation calibrate camera {without_password(source)}"
    if missing:
        remark += f"; not covered: {', '.join(missing)}"
    today = datetime.datetime.now().astimezone().date()
    text = calibration_text(fit.lens, fit.std, len(fit.by_view_px), today, remark)
    with replaced_file(output) as partial:
        partial.write_text(text, encoding="utf-8")
    click.echo(f"wrote {output}")

"""`groundstation calibrate check`: checks whether calibration and mounting of a camera still hold."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from groundstation.cli.exits import ExitCode
from groundstation.cli.numbers import FiniteRange
from groundstation.cli.sources import lens_of, require_size, source_of, until_interrupted
from groundstation.errors import GroundStationError, OperatorMistake

if TYPE_CHECKING:
    from drivers.camera.calibration.feed import SourcePicture
    from drivers.camera.calibration.static_markers import Steady
    from groundstation.geometry.lens import CameraIntrinsics
    from groundstation.settings.room import WorldCameraSettings
    from groundstation.settings.schema import Field

    Pictures = Callable[[str, WorldCameraSettings], Iterable[SourcePicture]]

_RESIDUAL_RATIO, _LEAST_LIMIT_PX = 3.0, 0.35
_PLACE_SIGMAS, _SAME_PLACE_M = 4.0, 0.03


@dataclass(frozen=True, slots=True)
class CheckFinding:
    """One result: its subject, whether it holds (None: unknown), and the remedy if it does not."""

    what: str
    holds: bool | None
    remedy: str = ""

    @property
    def text(self) -> str:
        """Return the result as a line."""
        word = {True: "holds", False: "DOES NOT HOLD", None: "is unknown"}[self.holds]
        return f"{word}: {self.what}" + (f"; {self.remedy}" if self.remedy and not self.holds else "")


@click.command(
    epilog="\b\nExamples:\n  groundstation calibrate check lab.yaml\n"
    "  groundstation calibrate check lab.yaml --marker 1=1.0,1.0 --marker 2=-1.0,1.0\n"
    "  groundstation calibrate check http://192.168.1.50:8080/video.mjpg --calibration cameras/ceiling.yaml\n"
    "  groundstation calibrate check runs/20261120T101500Z-lab --marker 8=1.0,1.0\n\n"
    "A field file: its fixed cameras are checked by markers on the floor; two that see one marker must agree on its "
    "place. --marker says where one lies. A recording (a run's folder, or one with pictures): the first pictures of "
    "its fixed cameras are checked against the field that was flown.\n\n"
    "Exit codes: 0 all that is known holds, 1 something does not or nothing is known, 2 wrong usage, 4 no pictures."
)
@click.argument("what")
@click.option(
    "--calibration", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="Calibration file of a source."
)
@click.option("--marker", "given", multiple=True, metavar="CODE=X,Y", help="A marker at a known place; repeatable.")
@click.option("--square-mm", type=FiniteRange(5, 200), default=44.0, show_default=True, help="Side of a square.")
@click.option("--frames", type=click.IntRange(1, 1000), default=10, show_default=True, help="Pictures to look at.")
def check(what: str, calibration: Path | None, given: tuple[str, ...], square_mm: float, frames: int) -> int:
    """Check the calibration of the cameras of WHAT (a field file, a recording, a source) by markers that lie still."""
    from groundstation.settings.floor_markers import floor_marker_of

    said = [floor_marker_of(text) for text in given]
    known = {marker.code: np.array(marker.position_m) for marker in said}
    if len(known) < len(said):
        raise click.UsageError("--marker: one marker is given twice")
    if known and calibration is not None:
        raise click.UsageError("--marker: where a camera hangs is in a field file; a source has a --calibration alone")
    if calibration is not None:
        context, parameter = click.get_current_context(), click.get_current_context().command.params[0]
        source, lens = source_of(context, parameter, what), lens_of(calibration)
        seen = _seen(_live(source, lens), lens, str(calibration), frames)
        findings = list(_lens_findings(source, lens, seen, square_mm))
    else:
        field, pictures = _recorded(Path(what)) if _is_recording(Path(what)) else (_field_of(what), _of_camera)
        findings = list(_field_findings(field, pictures, known, square_mm, frames))
    click.echo("\n".join(finding.text for finding in findings))
    held = {finding.holds for finding in findings}
    return ExitCode.OK if True in held and False not in held else ExitCode.FAILED


def _field_of(name: str) -> "Field":
    from groundstation.settings.files import find_field
    from groundstation.settings.load import load_field

    if "://" in name or name.startswith("/dev/"):
        raise click.UsageError(f"{name}: with a source, say which --calibration FILE is meant to hold for it")
    return load_field(find_field(name))


def _is_recording(path: Path) -> bool:
    return any(path.glob("*.mcap")) if path.is_dir() else path.suffix == ".mcap" and path.is_file()


def _recorded(path: Path) -> "tuple[Field, Pictures]":
    """Return the flown field, and a function that returns the pictures of its cameras."""
    from groundstation.cli.recorded_pictures import recorded_pictures
    from groundstation.recording.preamble import FIELD_NAME
    from groundstation.recording.reader import RecordingError
    from groundstation.recording.run import open_run
    from groundstation.settings.recorded import recorded_field

    try:
        run = open_run(path)
    except RecordingError as error:
        raise click.UsageError(str(error)) from error
    if FIELD_NAME not in run.attachments:
        raise click.UsageError(f"{path}: no recording of a ground station (no field is in it)")
    return recorded_field(run.attachments[FIELD_NAME]), lambda name, _: recorded_pictures(run, name)


def _of_camera(_name: str, camera: "WorldCameraSettings") -> "Iterable[SourcePicture]":
    from groundstation.geometry.lens import intrinsics_of

    return _live(camera.source, intrinsics_of(camera.calibration))


def _live(source: str, lens: "CameraIntrinsics") -> "Iterable[SourcePicture]":
    from drivers.camera.calibration.feed import shots

    return shots(source, (lens.width_px, lens.height_px))


def _seen(
    pictures: "Iterable[SourcePicture]", lens: "CameraIntrinsics", calibration: str, frames: int
) -> "Mapping[int, Steady]":
    from drivers.camera.calibration.static_markers import Gathering

    gathering = Gathering(lens)
    with until_interrupted():
        for picture in pictures:
            require_size(picture, lens, calibration)
            gathering.take(picture.grey)
            if gathering.pictures >= frames:
                break
    return gathering.steady()


def _lens_findings(
    name: str, lens: "CameraIntrinsics", seen: "Mapping[int, Steady]", square_mm: float
) -> Iterator[CheckFinding]:
    from drivers.camera.calibration.static_markers import flat_points
    from drivers.camera.pose import planar_poses

    if not seen:
        yield CheckFinding(f"{name}: no marker in view", None, "lay out two or three, also near the picture's corners")
        return
    limit = max(_LEAST_LIMIT_PX, _RESIDUAL_RATIO * lens.residual_px)
    for code, steady in seen.items():
        if steady.moved:
            yield CheckFinding(f"{name}: marker {code} moved", None, "lay it down, and keep still what carries it")
            continue
        poses = planar_poses(steady.corners, flat_points(square_mm), lens)
        squared = min((pose.squared_error for pose in poses), default=math.inf)
        rms = math.sqrt(squared / (2 * len(steady.corners) - 6))
        remedy = "is the marker flat? else groundstation calibrate camera: lens or focus were changed"
        yield CheckFinding(
            f"{name}: marker {code} fits the lens to {rms:.2f} px (limit {limit:.2f})", rms <= limit, remedy
        )


def _field_findings(
    field: "Field", pictures: "Pictures", known: dict[int, Any], square_mm: float, frames: int
) -> Iterator[CheckFinding]:
    from groundstation.geometry.lens import intrinsics_of

    places: dict[int, dict[str, tuple[Any, float]]] = {}
    remedy = "check the camera and its address" if pictures is _of_camera else ""
    for name, camera in field.cameras.items():
        lens = intrinsics_of(camera.calibration)
        try:
            seen = _seen(pictures(name, camera), lens, f"of {name}", frames)
        except OperatorMistake as error:
            yield CheckFinding(f"{name}: {error}", False)
            continue
        except GroundStationError as error:
            yield CheckFinding(f"{name}: {error}", None, remedy)
            continue
        yield from _lens_findings(name, lens, seen, square_mm)
        for code, steady in seen.items():
            placed = None if steady.moved else _placed(camera, lens, steady, square_mm)
            if placed is not None:
                places.setdefault(code, {})[name] = placed
    for code, by_camera in sorted(places.items()):
        yield from _place_findings(code, by_camera, known.get(code))
    if not field.cameras:
        yield CheckFinding("the field has no fixed camera", None, "name a source, and its --calibration")
    for code in sorted(known.keys() - places.keys()):
        yield CheckFinding(
            f"marker {code}: no camera has it in view, lying still", None, "see that it lies where you said"
        )


def _placed(camera: Any, lens: "CameraIntrinsics", steady: "Steady", square_mm: float) -> tuple[Any, float] | None:
    """Return a marker's place by a camera [m; world], and its standard deviation by mounting and corners."""
    from drivers.camera.calibration.static_markers import flat_points
    from drivers.camera.pose import planar_poses, pose_covariance
    from groundstation.geometry.rotations import world_from_downward_optical

    points = flat_points(square_mm)
    poses = planar_poses(steady.corners, points, lens)
    if not poses:
        return None
    best = min(poses, key=lambda pose: pose.squared_error)
    rotation = world_from_downward_optical(camera.rotation_deg)
    own = float(np.sqrt(np.diag(pose_covariance(best, points, lens, lens.residual_px))[3:].max()))
    reach = float(np.linalg.norm(best.translation))
    std = math.hypot(own, math.hypot(camera.position_std_m, camera.attitude_std_rad * reach))
    return rotation @ best.translation + np.array(camera.position_m), std


def _place_findings(code: int, by_camera: dict[str, tuple[Any, float]], said: Any) -> Iterator[CheckFinding]:
    remedy = "a camera was moved: groundstation calibrate extrinsics"
    for name, (place, std) in by_camera.items():
        if said is not None:
            gap = float(np.linalg.norm(place - said))
            limit = max(_SAME_PLACE_M, _PLACE_SIGMAS * std)
            text = f"{name}: has marker {code} {gap * 100:.1f} cm from where it lies (limit {limit * 100:.1f})"
            yield CheckFinding(text, gap <= limit, remedy)
    names = list(by_camera)
    for first, second in pairwise(names):
        (a, std_a), (b, std_b) = by_camera[first], by_camera[second]
        gap, limit = float(np.linalg.norm(a - b)), max(_SAME_PLACE_M, _PLACE_SIGMAS * math.hypot(std_a, std_b))
        text = f"{first} and {second} have marker {code} {gap * 100:.1f} cm apart (limit {limit * 100:.1f})"
        yield CheckFinding(text, gap <= limit, remedy)

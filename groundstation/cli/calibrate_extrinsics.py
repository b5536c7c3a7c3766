"""`groundstation calibrate extrinsics`: measures a camera's place from markers at known places."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from groundstation.cli.exits import ExitCode
from groundstation.cli.numbers import FiniteRange
from groundstation.cli.sources import lens_of, require_folder, require_size, source_of, until_interrupted
from groundstation.errors import OperatorMistake

if TYPE_CHECKING:
    from drivers.camera.calibration.extrinsics import Placing
    from drivers.camera.calibration.static_markers import Gathering
    from groundstation.geometry.lens import CameraIntrinsics
    from groundstation.settings.floor_markers import FloorMarkers

_LEAST_STD_DEG, _LEAST_STD_M = 0.01, 0.001
_ROLLED_DEG = 1.0
# Errors of the prints worth a remark, and the deviation with which a layout must show them.
_WORTH_SCALE, _SHOWN_SCALE = 0.01, 0.005


@click.command(
    epilog="\b\nExamples:\n"
    "  groundstation calibrate extrinsics http://192.168.1.50:8080/video.mjpg --calibration cameras/ceiling.yaml \\\n"
    "      --marker 1=1.0,1.0 --marker 2=-1.0,1.0 --marker 3=-1.0,-1.0 --marker 4=1.0,-1.0\n"
    "  groundstation calibrate extrinsics /dev/video0 --calibration cameras/ceiling.yaml --markers floor.yaml\n"
    "  groundstation calibrate extrinsics rtsp://192.168.1.60/front --calibration cameras/front.yaml \\\n"
    "      --onboard --marker 3=0.9,0.0,-0.12,0\n\n"
    "A marker is CODE=X,Y[,Z[,HEADING]]: centre [m], heading of its bar [deg]. Fixed cameras: in the world. --onboard: "
    "relative to the drone, which stands level: x ahead, y left, z up; Z is then mostly below zero.\n\n"
    "Exit codes: 0 measured, 2 wrong usage, 4 no pictures, or too little in them."
)
@click.argument("source", callback=source_of)
@click.option(
    "--calibration",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    required=True,
    help="The camera's calibration file.",
)
@click.option("--marker", "given", multiple=True, metavar="CODE=X,Y", help="A marker at a known place; repeatable.")
@click.option(
    "--markers", "layout", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="YAML with all markers."
)
@click.option("--square-mm", type=FiniteRange(5, 200), help="Side of their squares.  [default: 44]")
@click.option(
    "--marker-std-mm", type=FiniteRange(0.1, 200), help="Standard deviation of their positions.  [default: 5]"
)
@click.option("--frames", type=click.IntRange(1, 1000), default=20, show_default=True, help="Pictures to average.")
@click.option("--onboard", is_flag=True, help="A drone's camera on a bench instead of one fixed in the world.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path, file_okay=False), help="Write the last picture here, annotated."
)
def extrinsics(source: str, calibration: Path, **options: Any) -> int:
    """Measure position and orientation of the camera at SOURCE, and print the lines for the field file."""
    from drivers.camera.calibration.extrinsics import Mark, place_camera

    layout = _layout_of(options)
    lens = lens_of(calibration)
    if options["output"] is not None:
        require_folder(options["output"])
    gathering = _gather(source, lens, str(calibration), options["frames"], options["output"])
    steady = gathering.steady()
    named = {marker.code for marker in layout.markers}
    _require_sound(gathering, named)
    marks = [Mark(m.code, m.position_m, None if m.yaw_deg is None else math.radians(m.yaw_deg)) for m in layout.markers]
    placing = place_camera(marks, steady, lens, layout.square_mm, layout.position_std_m)
    used = sorted((named & set(steady)) - set(placing.misplaced))
    click.echo(f"# {gathering.pictures} pictures, markers {', '.join(map(str, used))}, rms {placing.rms_px:.2f} px")
    for remark in _remarks(gathering, named, layout, placing):
        click.echo(f"note: {remark}", err=True)
    click.echo("\n".join(_onboard_lines(placing) if options["onboard"] else _world_lines(placing)))
    return ExitCode.OK


def _layout_of(options: dict[str, Any]) -> "FloorMarkers":
    from groundstation.settings.floor_markers import FloorMarkers, floor_marker_of, load_floor_markers

    if bool(options["layout"]) == bool(options["given"]):
        raise click.UsageError("say where the markers are: --marker CODE=X,Y (often), or --markers FILE")
    if options["layout"]:
        layout = load_floor_markers(options["layout"])
    else:
        layout = FloorMarkers(markers=tuple(floor_marker_of(text) for text in options["given"]))
    if not layout.markers:
        raise OperatorMistake(f"{options['layout']}: there is no marker in it")
    codes = [marker.code for marker in layout.markers]
    twice = sorted({code for code in codes if codes.count(code) > 1})
    if twice:
        raise OperatorMistake(f"marker {twice[0]} is given twice")
    changes: dict[str, float] = {}
    if options["square_mm"]:
        changes["square_mm"] = options["square_mm"]
    if options["marker_std_mm"]:
        changes["position_std_m"] = options["marker_std_mm"] / 1000
    return layout.model_copy(update=changes)


def _gather(source: str, lens: "CameraIntrinsics", calibration: str, frames: int, output: Path | None) -> "Gathering":
    from drivers.camera.calibration import annotate
    from drivers.camera.calibration.feed import shots
    from drivers.camera.calibration.static_markers import Gathering

    gathering = Gathering(lens)
    with until_interrupted():
        for shot in shots(source, (lens.width_px, lens.height_px)):
            require_size(shot, lens, calibration)
            seen = gathering.take(shot.grey)
            if output is not None:
                drawn = annotate.canvas(shot.grey)
                for one in seen:
                    colour = annotate.BAD if one.code is None else annotate.GOOD
                    annotate.dots(drawn, one.corners, colour)
                    annotate.label(drawn, "?" if one.code is None else str(one.code), one.corners[0], colour)
                annotate.save(output, "extrinsics", drawn)
            if gathering.pictures >= frames:
                break
    return gathering


def _require_sound(gathering: "Gathering", named: set[int]) -> None:
    doubled = sorted(gathering.doubled & named)
    if doubled:
        raise OperatorMistake(f"two markers with code {doubled[0]} are in view: cover one of them")
    mirrored = sorted(gathering.mirrored & named)
    if mirrored and not gathering.steady():
        which = f"marker{'s' * (len(mirrored) > 1)} {', '.join(map(str, mirrored))}"
        raise OperatorMistake(f"{which} can be read in a mirror only: switch off the camera's flip, or print again")
    moved = [code for code, steady in gathering.steady().items() if steady.moved and code in named]
    if moved:
        raise OperatorMistake(f"marker {moved[0]} moved between the pictures: camera and markers must be still")


def _remarks(gathering: "Gathering", named: set[int], layout: "FloorMarkers", placing: "Placing") -> list[str]:
    seen = set(gathering.steady())
    remarks = [f"marker {code} was not seen" for code in sorted(named - seen)]
    remarks += [f"marker {code} is in view, and nobody said where it lies" for code in sorted(seen - named)]
    remarks += [
        f"marker {code} seems to lie {offset * 100:.1f} cm from where you said, and was left out: measure it again"
        for code, offset in placing.misplaced.items()
    ]
    remarks += [
        f"marker {code} seems to lie {offset * 100:.1f} cm from where you said: measure the places again"
        for code, offset in placing.offsets_m.items()
        if offset > 3.0 * layout.position_std_m
    ]
    remarks += _remarks_on_prints(layout.square_mm, placing)
    if gathering.unread:
        remarks.append(f"{gathering.unread} boards could not be read: are they near and sharp enough?")
    if len(seen & named) == 1:
        remarks.append("one marker alone: its heading and place are all that there is; two or more are much better")
    return remarks


def _remarks_on_prints(square_mm: float, placing: "Placing") -> list[str]:
    remarks = []
    if abs(placing.scale) > _WORTH_SCALE:
        wrong = "small" if placing.scale < 0 else "large"
        remarks.append(
            f"the markers seem to be printed {abs(placing.scale) * 100:.1f} % too {wrong} "
            f"(squares of {square_mm * (1.0 + placing.scale):.1f} mm, not {square_mm:g}), or their places are measured "
            "wrongly: measure a print with a ruler, and give --square-mm; the deviations cover both until then"
        )
    if len(placing.offsets_m) > 1 and placing.layout_scale_std > _SHOWN_SCALE:
        remarks.append(
            "the markers lie too close together to show whether their prints have the right size, on which the "
            "distance of the camera then depends: lay them further apart"
        )
    return remarks


def _list(values: Any, digits: int) -> str:
    return "[" + ", ".join(f"{float(value) + 0.0:.{digits}f}" for value in values) + "]"


def _world_lines(placing: "Placing") -> list[str]:
    from groundstation.geometry.rotations import WORLD_FROM_DOWNWARD_OPTICAL, euler_from_rotation

    turn = np.degrees(euler_from_rotation(placing.pose.rotation @ WORLD_FROM_DOWNWARD_OPTICAL.T))
    attitude = np.degrees(placing.attitude_std_rad)
    return [
        "# into the camera's entry below `cameras:`",
        f"position_m: {_list(placing.pose.translation, 4)}   # +- {_list(placing.position_std_m, 4)}",
        "looking: down",
        f"rotation_deg: {_list(turn, 3)}   # roll, pitch, yaw; +- {_list(attitude, 3)}",
        *_deviations(placing),
    ]


def _deviations(placing: "Placing") -> list[str]:
    attitude_deg, position_m = math.degrees(placing.attitude_std_rad.max()), float(placing.position_std_m.max())
    return [
        f"attitude_std_deg: {max(_LEAST_STD_DEG, attitude_deg):.3f}",
        f"position_std_m: {max(_LEAST_STD_M, position_m):.4f}",
    ]


def _onboard_lines(placing: "Placing") -> list[str]:
    from groundstation.geometry.rotations import BASE_FROM_LEVEL_OPTICAL, euler_from_rotation

    roll, tilt, pan = np.degrees(euler_from_rotation(placing.pose.rotation @ BASE_FROM_LEVEL_OPTICAL.T))
    attitude = np.degrees(placing.attitude_std_rad)
    if abs(roll) > max(_ROLLED_DEG, 3.0 * float(attitude[0])):
        click.echo(
            f"note: the picture is rolled by {roll:.1f} deg, which the field file cannot hold: does the drone stand "
            "level, is the camera straight?",
            err=True,
        )
    return [
        "# into the drone's `camera:`",
        f"position_m: {_list(placing.pose.translation, 4)}   # +- {_list(placing.position_std_m, 4)}",
        f"tilt_down_deg: {tilt:.3f}   # +- {attitude[1]:.3f}",
        f"pan_left_deg: {pan:.3f}   # +- {attitude[2]:.3f}",
        *_deviations(placing),
    ]

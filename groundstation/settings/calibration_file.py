"""Reads and writes calibration files (config/cameras/*.yaml)."""

import datetime
import json
from collections.abc import Mapping
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from groundstation.errors import SettingsError
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.settings.foreign_lens import read_calibration
from groundstation.settings.room import CalibrationSettings
from groundstation.settings.wording import ordered, problem_of_error


def load_calibration(path: Path) -> CalibrationSettings:
    """Return a calibration file's content; raises SettingsError with all problems, each with its line."""
    tree = read_calibration(path)
    text = json.dumps(tree.plain())
    try:
        return TypeAdapter(CalibrationSettings).validate_json(text)
    except ValidationError as error:
        found = error.errors(include_url=False)
        raise SettingsError(ordered([problem_of_error(one, tree, CalibrationSettings) for one in found])) from None


def calibration_text(
    lens: CameraIntrinsics, std: Mapping[str, float], views: int, day: datetime.date, remark: str
) -> str:
    """Return a calibration file; `remark` goes into its first line as a comment, std is by name of the figure."""
    distortion = ", ".join(f"{value:.6g}" for value in lens.distortion)
    figures = ", ".join(f"{name}: {value:.2g}" for name, value in std.items())
    lines = [
        f"# {remark}",
        "schema_version: 1",
        "model: plumb_bob",
        f"width_px: {lens.width_px}",
        f"height_px: {lens.height_px}",
        *(f"{name}: {getattr(lens, name):.4f}" for name in ("fx_px", "fy_px", "cx_px", "cy_px")),
        f"distortion: [{distortion}]   # k1 k2 p1 p2 k3",
        f"residual_px: {lens.residual_px:.4f}",
        f"date: {day.isoformat()}",
        f"views: {views}",
        f"std: {{{figures}}}   # one sigma",
    ]
    return "\n".join(lines) + "\n"

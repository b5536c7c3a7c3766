"""Warnings about lens calibrations that are permitted but of no use."""

import math
from collections.abc import Iterator

import numpy as np

from groundstation.geometry.lens import MOST_FOCAL_STD, MOST_RESIDUAL_PX
from groundstation.settings.document import KeyPath
from groundstation.settings.parts import Finding
from groundstation.settings.room import CalibrationSettings
from groundstation.settings.schema import Field

_MOST_CORNER_SHARE = 0.7


def lens_cautions(field: Field) -> Iterator[Finding]:
    """Yield the warnings about the lenses of a field."""
    lenses: list[tuple[KeyPath, CalibrationSettings]] = [
        (("cameras", name, "calibration"), camera.calibration) for name, camera in field.cameras.items()
    ]
    lenses += [
        (("drones", name, "camera", "calibration"), drone.camera.calibration) for name, drone in field.drones.items()
    ]
    for path, lens in lenses:
        yield from (((*path, "distortion"), text) for text in _odd(lens))
        yield from (((*path, key), text) for key, text in _inexact(lens))


def _odd(lens: CalibrationSettings) -> Iterator[str]:
    if _folds(lens):
        yield "folds the picture before its corners: no lens does that; calibrate it again"
    elif (share := _corner_share(lens)) > _MOST_CORNER_SHARE:
        yield f"moves the picture's corners by {share:.0%} of their distance from its middle: calibrate it again"


def _inexact(lens: CalibrationSettings) -> Iterator[tuple[str, str]]:
    if lens.residual_px > MOST_RESIDUAL_PX:
        text = f"says that the lens fits its own calibration badly (got {lens.residual_px:g}, usual is 0.2)"
        yield "residual_px", f"{text}: distances would be off by 1 % and more; calibrate it again"
    share = 0.0 if lens.std is None else max(lens.std.fx_px / lens.fx_px, lens.std.fy_px / lens.fy_px)
    if share > MOST_FOCAL_STD:
        text = f"leaves the focal length uncertain by {share:.0%}, and distances with it"
        yield "std", f"{text}: calibrate it again, with the board tilted by 20 to 40 degrees"


def _corner_share(lens: CalibrationSettings) -> float:
    """Return the greatest displacement of a corner by the distortion, relative to its distance from the axis."""
    k1, k2, p1, p2, k3 = lens.distortion
    half_x, half_y = lens.width_px / (2 * lens.fx_px), lens.height_px / (2 * lens.fy_px)
    r2 = half_x**2 + half_y**2
    radial = k1 * r2 + k2 * r2**2 + k3 * r2**3
    return max(
        math.hypot(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
        / math.sqrt(r2)
        for x in (-half_x, half_x)
        for y in (-half_y, half_y)
    )


def _folds(lens: CalibrationSettings) -> bool:
    """Return whether the distorted radius decreases anywhere up to nine tenths of the way to a corner."""
    corner = math.hypot(lens.width_px / (2 * lens.fx_px), lens.height_px / (2 * lens.fy_px))
    r2 = np.linspace(0.0, 0.9 * corner, 40) ** 2
    k1, k2, _, _, k3 = lens.distortion
    return bool(np.any(1.0 + 3.0 * k1 * r2 + 5.0 * k2 * r2**2 + 7.0 * k3 * r2**3 <= 0.0))

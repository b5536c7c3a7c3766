"""Compiled smooth availability and noise of a camera, with exact derivatives (docs/explanation/planning.md 3)."""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from groundstation.arrays import Array
from groundstation.kernel import Record, Rows, kernel
from groundstation.sensing.models import OnboardCameraModel, Softness, WorldCameraModel

STEEPEST_COS = math.cos(math.radians(70.0))
"""A flat marker is found up to this angle between its normal and the line of sight (docs/reference/vision.md 2)."""

SPREAD = math.pi / 8.0
"""What a Gaussian variance adds to the squared width of a logistic edge."""


class CameraRow(Record):
    """A camera as the kernels read it, fixed in the world or on a robot.

    position [m; world or base]; rotation: optical from world or from base_stabilized; tangents of half width and half
    height, cosines of the same angles, range and border [m] of the view; standard deviation of a position: base_m and
    per_m, per_m2 (by distance); of a heading [rad]; softness of the view's edge: width, share and length of its tail,
    caution.
    """

    position: Annotated[Array, (3,)]
    rotation: Annotated[Array, (3, 3)]
    half_width_tan: float
    half_height_tan: float
    across_cos: float
    along_cos: float
    range_m: float
    border_m: float
    base_m: float
    per_m: float
    per_m2: float
    yaw_rad: float
    width_m: float
    tail_share: float
    tail_m: float
    caution: float


class Availability(NamedTuple):
    """In what share of exposures a marker counts as shown, and the derivatives by its optical position [1/m]."""

    a: float
    a_x: float
    a_y: float
    a_z: float


def camera_rows(cameras: Sequence[WorldCameraModel | OnboardCameraModel], soft: Softness) -> Rows[CameraRow]:
    """Return the table of cameras, in the order given."""
    rows = CameraRow.rows(len(cameras))
    for index, camera in enumerate(cameras):
        row = rows[index]
        row["position"] = camera.position_m
        row["rotation"] = (
            camera.optical_from_world if isinstance(camera, WorldCameraModel) else camera.optical_from_base
        )
        for part in (camera.view, camera.noise, soft):
            for name in CameraRow.dtype.names or ():
                if hasattr(part, name):
                    row[name] = getattr(part, name)
        row["across_cos"] = math.cos(math.atan(camera.view.half_width_tan))
        row["along_cos"] = math.cos(math.atan(camera.view.half_height_tan))
    return rows


@kernel(inlined=True)
def share_of(exponent: float) -> float:
    """Return exp(exponent), and 0 for what would not count."""
    return math.exp(exponent) if exponent > -20.0 else 0.0


@kernel()
def margin(camera: CameraRow, x: float, y: float, z: float, distance: float) -> Availability:
    """Return the soft minimum of the distances to the view's limits at an optical point [m], and its derivatives.

    Limits: four side planes, the range, and the steepest angle between the marker's normal, which points up, and the
    line of sight.
    """
    tx, ty, border, width = camera.half_width_tan, camera.half_height_tan, camera.border_m, camera.width_m
    nx, ny, R, per_width = camera.across_cos, camera.along_cos, camera.rotation, 1.0 / width
    ux, uy, uz = R[0, 2], R[1, 2], R[2, 2]
    m0, m1 = (z * tx - x) * nx - border, (z * tx + x) * nx - border
    m2, m3 = (z * ty - y) * ny - border, (z * ty + y) * ny - border
    m4, m5 = camera.range_m - distance, -(ux * x + uy * y + uz * z) - STEEPEST_COS * distance
    least = min(min(min(m0, m1), min(m2, m3)), min(m4, m5))
    e0, e1 = share_of((least - m0) * per_width), share_of((least - m1) * per_width)
    e2, e3 = share_of((least - m2) * per_width), share_of((least - m3) * per_width)
    e4, e5 = share_of((least - m4) * per_width), share_of((least - m5) * per_width)
    total = e0 + e1 + e2 + e3 + e4 + e5
    away, per_total = (e4 + STEEPEST_COS * e5) / distance, 1.0 / total
    return Availability(
        least - width * math.log(total),
        ((e1 - e0) * nx - away * x - e5 * ux) * per_total,
        ((e3 - e2) * ny - away * y - e5 * uy) * per_total,
        ((e0 + e1) * nx * tx + (e2 + e3) * ny * ty - away * z - e5 * uz) * per_total,
    )


@kernel()
def available(
    camera: CameraRow, x: float, y: float, z: float, blur_m2: float, turn_rad2: float, share: float
) -> Availability:
    """Return the availability of a marker at an optical point [m] that is counted on if its place is in doubt.

    blur_m2: variance of the relative position per axis; turn_rad2: of the direction of view; share: of the tail that
    attracts. Expected under these variances, `camera.caution` standard deviations farther out.
    """
    square = x * x + y * y + z * z + 1e-6
    m = margin(camera, x, y, z, math.sqrt(square))
    error2 = blur_m2 + turn_rad2 * square
    error = math.sqrt(error2 + 1e-12)
    inside = m.a - camera.caution * error
    # A logistic edge, seen with a Gaussian error, is again nearly logistic (MacKay 1992): only wider.
    width2 = camera.width_m * camera.width_m + SPREAD * error2
    width = math.sqrt(width2)
    logistic = 1.0 / (1.0 + math.exp(min(-inside / width, 500.0)))
    flat, slope = 1.0, 0.0
    if inside < 0.0:
        ratio = inside / camera.tail_m
        flat = 1.0 / (1.0 + ratio * ratio)
        slope = -2.0 * ratio / camera.tail_m * flat * flat
    steep = (1.0 - share) * logistic * (1.0 - logistic) / width
    inwards = steep + share * slope
    # d width = SPREAD turn / width * (x, y, z), d error = turn / error * (x, y, z)
    widening = -steep * inside / width2 * SPREAD * turn_rad2 - inwards * camera.caution * turn_rad2 / error
    return Availability(
        (1.0 - share) * logistic + share * flat,
        inwards * m.a_x + widening * x, inwards * m.a_y + widening * y, inwards * m.a_z + widening * z,
    )  # fmt: skip

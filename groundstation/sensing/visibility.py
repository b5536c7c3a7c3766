"""Compiled smooth availability and noise of a camera, with exact derivatives (docs/explanation/planning.md 3)."""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from groundstation.arrays import Array, Matrix
from groundstation.kernel import Record, Rows, kernel
from groundstation.sensing.elementary import decay, log_of_sum
from groundstation.sensing.models import STEEPEST_COS, OnboardCameraModel, Softness, WorldCameraModel

SPREAD = math.pi / 8.0
"""Factor with which a Gaussian variance adds to the squared width of a logistic edge."""


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


class ViewLimits(NamedTuple):
    """The limits of a camera's view: fields of `CameraRow`, and the upward direction in the camera's frame."""

    half_width_tan: float
    half_height_tan: float
    across_cos: float
    along_cos: float
    up_x: float
    up_y: float
    up_z: float
    range_m: float
    border_m: float
    width_m: float
    tail_m: float
    caution: float


class Availability(NamedTuple):
    """The share of exposures in which a marker is shown, and its derivatives by optical position [1/m]."""

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


@kernel()
def limits_of(camera: CameraRow) -> ViewLimits:
    """Return the limits of a camera's view."""
    R = camera.rotation
    return ViewLimits(
        camera.half_width_tan, camera.half_height_tan, camera.across_cos, camera.along_cos, R[0, 2], R[1, 2], R[2, 2],
        camera.range_m, camera.border_m, camera.width_m, camera.tail_m, camera.caution,
    )  # fmt: skip


@kernel(inlined=True)
def lesser(a: float, b: float) -> float:
    """Return the lesser of two numbers, without the NaN checks that keep `min` from being vectorised."""
    return a if a < b else b


@kernel(inlined=True, contract=True)
def margin(view: ViewLimits, x: float, y: float, z: float, distance: float) -> Availability:
    """Return the soft minimum of the distances to the view's limits at an optical point [m], and its derivatives.

    Limits: four side planes, the range, and the steepest angle between the marker's normal, which points up, and the
    line of sight.
    """
    tx, ty, border, width = view.half_width_tan, view.half_height_tan, view.border_m, view.width_m
    nx, ny, per_width = view.across_cos, view.along_cos, 1.0 / width
    ux, uy, uz = view.up_x, view.up_y, view.up_z
    m0, m1 = (z * tx - x) * nx - border, (z * tx + x) * nx - border
    m2, m3 = (z * ty - y) * ny - border, (z * ty + y) * ny - border
    m4, m5 = view.range_m - distance, -(ux * x + uy * y + uz * z) - STEEPEST_COS * distance
    least = lesser(lesser(lesser(m0, m1), lesser(m2, m3)), lesser(m4, m5))
    e0, e1 = decay((least - m0) * per_width), decay((least - m1) * per_width)
    e2, e3 = decay((least - m2) * per_width), decay((least - m3) * per_width)
    e4, e5 = decay((least - m4) * per_width), decay((least - m5) * per_width)
    total = e0 + e1 + e2 + e3 + e4 + e5
    away, per_total = (e4 + STEEPEST_COS * e5) / distance, 1.0 / total
    return Availability(
        least - width * log_of_sum(total),
        ((e1 - e0) * nx - away * x - e5 * ux) * per_total,
        ((e3 - e2) * ny - away * y - e5 * uy) * per_total,
        ((e0 + e1) * nx * tx + (e2 + e3) * ny * ty - away * z - e5 * uz) * per_total,
    )


@kernel(inlined=True, contract=True)
def available(
    view: ViewLimits, x: float, y: float, z: float, blur_m2: float, turn_rad2: float, share: float
) -> Availability:
    """Return the availability of a marker at an uncertain optical point [m].

    blur_m2: variance of the relative position per axis; turn_rad2: of the direction of view; share: of the tail that
    attracts. It is the expected value under these variances, `view.caution` standard deviations farther out.
    """
    square = x * x + y * y + z * z + 1e-6
    m = margin(view, x, y, z, math.sqrt(square))
    error2 = blur_m2 + turn_rad2 * square
    error = math.sqrt(error2 + 1e-12)
    inside = m.a - view.caution * error
    # A logistic edge, seen with a Gaussian error, is again nearly logistic (MacKay 1992): only wider.
    per_width = 1.0 / math.sqrt(view.width_m * view.width_m + SPREAD * error2)
    per_tail, over = 1.0 / view.tail_m, inside * per_width
    rare = decay(-abs(over))
    rare = rare / (1.0 + rare)
    logistic = rare if inside < 0.0 else 1.0 - rare
    ratio = lesser(inside, 0.0) * per_tail
    flat = 1.0 / (1.0 + ratio * ratio)
    slope = -2.0 * ratio * per_tail * flat * flat
    steep = (1.0 - share) * logistic * (1.0 - logistic) * per_width
    inwards = steep + share * slope
    # d width = SPREAD turn / width * (x, y, z), d error = turn / error * (x, y, z)
    widening = -(steep * over * per_width * SPREAD + inwards * view.caution / error) * turn_rad2
    return Availability(
        (1.0 - share) * logistic + share * flat,
        inwards * m.a_x + widening * x, inwards * m.a_y + widening * y, inwards * m.a_z + widening * z,
    )  # fmt: skip


@kernel(contract=True)
def available_at_once(views: Matrix, points: Matrix, found: Matrix) -> None:
    """Write `available` (4, m) of m optical points (3, m) [m], each seen by a camera of its own.

    views (15, m): the limits in the order of `ViewLimits`, then blur_m2, turn_rad2 and share. One loop without
    branches, which is vectorised: the arithmetic is that of a single point, to the bit.
    """
    tx, ty, nx, ny, ux, uy, uz, ranges = (
        views[0], views[1], views[2], views[3], views[4], views[5], views[6], views[7]
    )  # fmt: skip
    borders, widths, tails, cautions = views[8], views[9], views[10], views[11]
    blurs, turns, shares = views[12], views[13], views[14]
    x, y, z = points[0], points[1], points[2]
    a, a_x, a_y, a_z = found[0], found[1], found[2], found[3]
    for e in range(points.shape[1]):
        limits = ViewLimits(
            tx[e], ty[e], nx[e], ny[e], ux[e], uy[e], uz[e], ranges[e], borders[e], widths[e], tails[e], cautions[e]
        )
        seen = available(limits, x[e], y[e], z[e], blurs[e], turns[e], shares[e])
        a[e], a_x[e], a_y[e], a_z[e] = seen.a, seen.a_x, seen.a_y, seen.a_z

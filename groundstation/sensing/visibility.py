"""Compiled smooth availability and noise of a camera, with exact derivatives (docs/explanation/planning.md 3)."""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from groundstation.arrays import Array
from groundstation.kernel import Record, Rows, kernel
from groundstation.sensing.models import OnboardCameraModel, Softness, WorldCameraModel


class CameraRow(Record):
    """A camera as the kernels read it, fixed in the world or on a robot.

    position [m; world or base]; rotation: optical from world or from base_stabilized; tangents of half width and half
    height, range and border [m] of the view; standard deviation of a position: base_m, per_m and per_m2 (by distance);
    of a heading [rad]; softness of the view's edge: width, share and length of its tail.
    """

    position: Annotated[Array, (3,)]
    rotation: Annotated[Array, (3, 3)]
    half_width_tan: float
    half_height_tan: float
    range_m: float
    border_m: float
    base_m: float
    per_m: float
    per_m2: float
    yaw_rad: float
    width_m: float
    tail_share: float
    tail_m: float


class Information(NamedTuple):
    """Expected information of one sighting, and its derivatives by the subject's optical position.

    w: of each position axis [1/m^2]; v: of the heading [1/rad^2].
    """

    w: float
    w_x: float
    w_y: float
    w_z: float
    v: float
    v_x: float
    v_y: float
    v_z: float


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
    return rows


@kernel()
def observe(camera: CameraRow, x: float, y: float, z: float) -> Information:
    """Return the expected information of a sighting at an optical point [m]: availability over variance."""
    tx, ty, reach, border = camera.half_width_tan, camera.half_height_tan, camera.range_m, camera.border_m
    width, share, tail = camera.width_m, camera.tail_share, camera.tail_m
    nx, ny = 1.0 / math.sqrt(1.0 + tx * tx), 1.0 / math.sqrt(1.0 + ty * ty)
    d2 = x * x + y * y + z * z + 1e-6
    d = math.sqrt(d2)
    m0, m1 = (z * tx - x) * nx - border, (z * tx + x) * nx - border
    m2, m3 = (z * ty - y) * ny - border, (z * ty + y) * ny - border
    m4 = reach - d
    least = min(min(min(m0, m1), min(m2, m3)), m4)
    e0, e1 = math.exp((least - m0) / width), math.exp((least - m1) / width)
    e2, e3, e4 = (
        math.exp((least - m2) / width),
        math.exp((least - m3) / width),
        math.exp((least - m4) / width),
    )
    total = e0 + e1 + e2 + e3 + e4
    margin = least - width * math.log(total)
    fx = ((e1 - e0) * nx - e4 * x / d) / total
    fy = ((e3 - e2) * ny - e4 * y / d) / total
    fz = ((e0 + e1) * nx * tx + (e2 + e3) * ny * ty - e4 * z / d) / total
    # Logistic inside, a share of an inverse-square tail outside, so that what is lost still pulls.
    logistic = 1.0 / (1.0 + math.exp(min(-margin / width, 500.0)))
    flat, slope = 1.0, 0.0
    if margin < 0.0:
        ratio = margin / tail
        flat = 1.0 / (1.0 + ratio * ratio)
        slope = -2.0 * ratio / tail * flat * flat
    a = (1.0 - share) * logistic + share * flat
    da = (1.0 - share) * logistic * (1.0 - logistic) / width + share * slope
    per1, per2 = camera.per_m * camera.per_m, camera.per_m2 * camera.per_m2
    variance = camera.base_m * camera.base_m + per1 * d2 + per2 * d2 * d2
    dv = 2.0 * per1 + 4.0 * per2 * d2  # d variance = dv * (x, y, z)
    w = a / variance
    heading = 1.0 / (camera.yaw_rad * camera.yaw_rad)
    return Information(
        w, (da * fx - w * dv * x) / variance, (da * fy - w * dv * y) / variance, (da * fz - w * dv * z) / variance,
        a * heading, da * fx * heading, da * fy * heading, da * fz * heading,
    )  # fmt: skip

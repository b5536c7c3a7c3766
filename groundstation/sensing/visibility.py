"""Compiled smooth availability and noise of a camera, with exact derivatives; formulas in README.md."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from groundstation.sensing.models import Frustum, Noise, OnboardCamera, Softness, WorldCamera

Array = NDArray[np.float64]

# Columns of a camera row.
POSITION = 0  # 3: world (fixed) or base (onboard)
ROTATION = 3  # 9: optical from world or from base_stabilized, row-major
VIEW = 12  # tangents of half width and half height, range, border
NOISE = 16  # base, per m, per m2, yaw
SOFT = 20  # width, tail share, tail length
ROW = 23


def _row(position: tuple[float, ...], rotation: Array, view: Frustum, noise: Noise, soft: Softness) -> Array:
    return np.array(
        [
            *position,
            *rotation.ravel(),
            *(view.half_width_tan, view.half_height_tan, view.range_m, view.border_m),
            *(noise.base_m, noise.per_m, noise.per_m2, noise.yaw_rad),
            *(soft.width_m, soft.tail_share, soft.tail_m),
        ]
    )


def row_of_world_camera(camera: WorldCamera, soft: Softness) -> Array:
    """Return a world-fixed camera as the kernels read it (ROW)."""
    return _row(camera.position_m, camera.optical_from_world, camera.view, camera.noise, soft)


def row_of_onboard_camera(camera: OnboardCamera, soft: Softness) -> Array:
    """Return a robot's camera as the kernels read it (ROW)."""
    return _row(camera.position_m, camera.optical_from_base, camera.view, camera.noise, soft)


@njit("void(float64[::1], float64, float64, float64, float64[::1])", cache=True, nogil=True, error_model="numpy")
def observe(camera: Array, x: float, y: float, z: float, out: Array) -> None:
    """Write informations at an optical point: out = (w, dw/dx, dw/dy, dw/dz, v, dv/dx, dv/dy, dv/dz).

    w = availability / position variance [1/m^2], v = availability / heading variance [1/rad^2].
    """
    tx, ty, reach, border = camera[VIEW], camera[VIEW + 1], camera[VIEW + 2], camera[VIEW + 3]
    width, share, tail = camera[SOFT], camera[SOFT + 1], camera[SOFT + 2]
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
    per1, per2 = camera[NOISE + 1] * camera[NOISE + 1], camera[NOISE + 2] * camera[NOISE + 2]
    variance = camera[NOISE] * camera[NOISE] + per1 * d2 + per2 * d2 * d2
    dv = 2.0 * per1 + 4.0 * per2 * d2  # d variance = dv * (x, y, z)
    w = a / variance
    out[0] = w
    out[1] = (da * fx - w * dv * x) / variance
    out[2] = (da * fy - w * dv * y) / variance
    out[3] = (da * fz - w * dv * z) / variance
    heading = 1.0 / (camera[NOISE + 3] * camera[NOISE + 3])
    out[4] = a * heading
    out[5], out[6], out[7] = da * fx * heading, da * fy * heading, da * fz * heading

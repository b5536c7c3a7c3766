"""Edges of a level vector, and the information they carry at predicted positions.

Entities are 0..n-1 robots and n the target; -1 stands for the global sensor, fixed at the origin.
"""

import math

import numpy as np
from numba import njit

MAGIC = 6755399441055744.0  # 1.5 * 2^52: adding it leaves the nearest integer in the low bits of a float64


@njit("i8(i8[::1], i8[:, ::1])", cache=True, nogil=True)
def list_edges(level, edges):  # type: ignore[no-untyped-def]
    """Write the (observer, subject) pairs of a level vector into `edges`; return how many there are."""
    n = level.shape[0]
    last = 0
    for robot in range(n):
        last = max(last, level[robot])
    count = 0
    for a in range(n):
        if level[a] == 0:
            edges[count, 0], edges[count, 1] = -1, a
            count += 1
        if level[a] == last:
            edges[count, 0], edges[count, 1] = a, n
            count += 1
        for b in range(n):
            if level[b] == level[a] + 1:
                edges[count, 0], edges[count, 1] = a, b
                count += 1
    return count


@njit("void(f8[::1], f8[::1], i8)", cache=True, nogil=True, error_model="numpy")
def exponentials(x, out, count):  # type: ignore[no-untyped-def]
    """Write exp(x) for |x| <= 700 to within 2 ulp, in a form the compiler vectorises (math.exp is a call each).

    `x` is overwritten. No fastmath here: reassociation would cancel the rounding by MAGIC.
    """
    bits = out.view(np.int64)
    for e in range(count):
        out[e] = x[e] * 1.4426950408889634 + MAGIC
    for e in range(count):
        k = out[e] - MAGIC
        r = (x[e] - k * 0.693147180369123816490) - k * 1.90821492927058770002e-10
        x[e] = 1.0 + r * (
            1.0
            + r
            * (
                0.5
                + r
                * (
                    1 / 6
                    + r
                    * (
                        1 / 24
                        + r
                        * (
                            1 / 120
                            + r
                            * (
                                1 / 720
                                + r
                                * (
                                    1 / 5040
                                    + r
                                    * (
                                        1 / 40320
                                        + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800 + r / 479001600)))
                                    )
                                )
                            )
                        )
                    )
                )
            )
        )
        bits[e] = (bits[e] + 1023) << 52
    for e in range(count):
        out[e] *= x[e]


@njit(
    "void(f8[:, ::1], i8[:, ::1], i8, f8[::1], f8[::1], f8[::1], f8[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def edge_information(position, edges, count, constants, distance, work, information):  # type: ignore[no-untyped-def]
    """Write each edge's distance d [m] and information 1/R = 1 / (sigma^2 (1 + exp((d - r) / s))) [1/m^2]."""
    sigma, reach, softness, epsilon = constants[0], constants[1], constants[2], constants[3]
    for e in range(count):
        a, b = edges[e, 0], edges[e, 1]
        dx, dy = position[b, 0], position[b, 1]
        if a >= 0:
            dx -= position[a, 0]
            dy -= position[a, 1]
        distance[e] = math.sqrt(dx * dx + dy * dy + epsilon * epsilon)
        work[e] = min((distance[e] - reach) / softness, 40.0)
    exponentials(work, information, count)
    weight = 1.0 / (sigma * sigma)
    for e in range(count):
        information[e] = weight / (1.0 + information[e])

"""Edges of a team sorted by level, and the information they carry at predicted positions.

Entities are sorted so that each level is contiguous (robots 0..n-1, target n): what one observer sees is then a range
of subjects, and every loop over it runs on contiguous memory. Row 0 is the global sensor at the origin, row a + 1
robot a. Ranges are unsigned: signed indices are tested for counting from the end, and nothing is vectorised.
"""

import math

import numpy as np
from numba import njit

MAGIC = 6755399441055744.0  # 1.5 * 2^52: adding it leaves the nearest integer in the low bits of a float64
_FARTHEST = 40.0  # exponent beyond which a reading carries no information worth a different number


@njit("i8(i8[::1], i8[::1], u8[:, ::1])", cache=True, nogil=True)
def sort_team(level, order, rows):  # type: ignore[no-untyped-def]
    """Write the entities sorted by level into `order`, and (first subject, one past the last, first edge) per row.

    order (n + 1), rows (n + 2, 3); returns the number of edges, which also stands in rows[n + 1, 2].
    """
    n = level.shape[0]
    start = np.zeros(n + 2, np.int64)
    last = 0
    rows[0, 2] = 0
    for robot in range(n):
        start[level[robot] + 1] += 1
        last = max(last, level[robot])
    for k in range(last + 1):
        start[k + 1] += start[k]
    rows[0, 0], rows[0, 1] = 0, start[1]
    for k in range(last + 1):
        for a in range(start[k], start[k + 1]):
            rows[a + 1, 0] = start[k + 1]
            rows[a + 1, 1] = start[k + 2] if k < last else n + 1
    for robot in range(n):
        order[start[level[robot]]] = robot
        start[level[robot]] += 1
    order[n] = n
    for row in range(n + 1):
        rows[row + 1, 2] = rows[row, 2] + rows[row, 1] - rows[row, 0]
    return np.int64(rows[n + 1, 2])


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
        tail = 1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800 + r / 479001600)))
        series = 1 / 24 + r * (1 / 120 + r * (1 / 720 + r * (1 / 5040 + r * tail)))
        x[e] = 1.0 + r * (1.0 + r * (0.5 + r * (1 / 6 + r * series)))
        bits[e] = (bits[e] + 1023) << 52
    for e in range(count):
        out[e] *= x[e]


@njit(
    "void(i8, f8[:, :, ::1], u8[:, ::1], f8[::1], f8[:, ::1], f8[::1], f8[:, ::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract"},
)
def edge_information(i, position, rows, constants, distance, work, information):  # type: ignore[no-untyped-def]
    """Write step i's distance d [m] and information of each edge, `information_at` d [1/m^2].

    position (h, 2, m); distance, information (h, edges).
    """
    sigma, reach, epsilon, tail = constants[0], constants[1], constants[3], constants[9]
    steepness, rounding = 1.0 / constants[2], epsilon * epsilon
    count = rows[rows.shape[0] - 1, 2]
    for row in range(rows.shape[0] - 1):
        x = position[i, 0, row - 1] if row > 0 else 0.0
        y = position[i, 1, row - 1] if row > 0 else 0.0
        first, shift = rows[row, 0], rows[row, 2] - rows[row, 0]
        for b in range(first, rows[row, 1]):
            dx, dy = position[i, 0, b] - x, position[i, 1, b] - y
            distance[i, b + shift] = dx * dx + dy * dy
    for e in range(count):
        d = math.sqrt(distance[i, e] + rounding)
        distance[i, e] = d
        work[e] = min((d - reach) * steepness, _FARTHEST)
    exponentials(work, information[i], np.int64(count))
    weight, square = 1.0 / (sigma * sigma), reach * reach
    for e in range(count):
        information[i, e] = weight / (1.0 + information[i, e])
    if tail > 0.0:
        for e in range(count):
            d = distance[i, e]
            information[i, e] += weight * tail * square / (square + d * d)


@njit("void(f8[:, ::1], u8[:, ::1], f8[:, ::1], i8)", cache=True, nogil=True, fastmath={"contract", "reassoc"})
def add_laplacian(matrix, rows, information, i):  # type: ignore[no-untyped-def]
    """Add sum_e w_e a_e a_e^T of step i to the upper triangle; observers come before what they see."""
    for row in range(rows.shape[0] - 1):
        first, end, shift = rows[row, 0], rows[row, 1], rows[row, 2] - rows[row, 0]
        for b in range(first, end):
            matrix[b, b] += information[i, b + shift]
        if row > 0:
            total = 0.0
            for b in range(first, end):
                total += information[i, b + shift]
                matrix[row - 1, b] -= information[i, b + shift]
            matrix[row - 1, row - 1] += total


@njit(
    "void(i8, f8[:, :, ::1], u8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, :, ::1], f8[::1], f8[::1], f8[:, :, ::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract", "reassoc"},
)
def position_gradient(  # type: ignore[no-untyped-def]
    i, position, rows, distance, information, columns, constants, work, gradient
):
    """Write dc/dposition of step i (2, m): dc/dw = -sum_c (Y[c, b] - Y[c, a])^2.

    With v the tail's part of w: dw/dd = -(w - v) (1 - sigma^2 (w - v)) / s - 2 v d / (r^2 + d^2).
    """
    sigma2, scale, steepness = constants[0] * constants[0], constants[4] * constants[6], 1.0 / constants[2]
    square = constants[1] * constants[1]
    tail = constants[9] * square / sigma2
    used = position.shape[0] - i
    gradient[i, :, :] = 0.0
    for row in range(rows.shape[0] - 1):
        first, end, shift = rows[row, 0], rows[row, 1], rows[row, 2] - rows[row, 0]
        x, y = 0.0, 0.0
        if row > 0:
            x, y = position[i, 0, row - 1], position[i, 1, row - 1]
        # Two columns at a time, the odd one first: levels are short, and each loop over one costs its start.
        odd = used % 2
        for b in range(first, end):
            difference = columns[i, 0, b] - (columns[i, 0, row - 1] if row > 0 else 0.0)
            work[b] = odd * difference * difference
        for c in range(odd, used, 2):
            own = columns[i, c, row - 1] if row > 0 else 0.0
            other = columns[i, c + 1, row - 1] if row > 0 else 0.0
            for b in range(first, end):
                difference = columns[i, c, b] - own
                work[b] += difference * difference + (columns[i, c + 1, b] - other) * (columns[i, c + 1, b] - other)
        sum_x, sum_y = 0.0, 0.0
        if tail > 0.0:
            for b in range(first, end):
                d = distance[i, b + shift]
                beyond = 1.0 / (square + d * d)
                w = information[i, b + shift] - tail * beyond
                work[b] *= w * (1.0 - sigma2 * w) * steepness / d + 2.0 * tail * beyond * beyond
        else:
            for b in range(first, end):
                w = information[i, b + shift]
                work[b] *= w * (1.0 - sigma2 * w) * steepness / distance[i, b + shift]
        for b in range(first, end):
            factor = scale * work[b]
            fx, fy = factor * (position[i, 0, b] - x), factor * (position[i, 1, b] - y)
            gradient[i, 0, b] += fx
            gradient[i, 1, b] += fy
            sum_x += fx
            sum_y += fy
        if row > 0:
            gradient[i, 0, row - 1] -= sum_x
            gradient[i, 1, row - 1] -= sum_y

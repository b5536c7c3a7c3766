"""Compiled smooth visibility past upright boxes, with exact derivatives (docs/explanation/planning.md 3)."""

import math
from collections.abc import Iterable
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array, Matrix, Vector
from groundstation.kernel import Record, Rows, kernel
from groundstation.sensing.models import Box

SOFT_M = 0.05
"""Width of the transition at a box's edge."""

_CLEAR = 20.0  # widths of a box's edge beyond which nothing is hidden


class BoxRow(Record):
    """A box along the world's axes: its middle and half of its size [m; world]."""

    middle: Annotated[Array, (3,)]
    half: Annotated[Array, (3,)]


class Sight(NamedTuple):
    """The chance that nothing is in between, and its derivatives by the eye and by the point [1/m; world]."""

    a: float
    eye_x: float
    eye_y: float
    eye_z: float
    x: float
    y: float
    z: float


def box_rows(boxes: Iterable[Box]) -> Rows[BoxRow]:
    """Return the table of boxes, in the order given."""
    chosen = tuple(boxes)
    rows = BoxRow.rows(len(chosen))
    for index, box in enumerate(chosen):
        rows[index]["middle"], rows[index]["half"] = box.middle_m, np.array(box.size_m) / 2.0
    return rows


@kernel(inlined=True)
def share_below(margin: float, width: float) -> float:
    """Return the logistic share of a soft limit that lies `margin` beyond a point."""
    return 1.0 / (1.0 + math.exp(min(max(margin / width, -500.0), 500.0)))


@kernel(inlined=True)
def passing(p: float, q: float, dp: float, dq: float, hp: float, hq: float) -> tuple[float, float, float, float, float]:
    """Return the distance at which a line passes a rectangle in its plane [m; negative: through it], and derivatives.

    Derivatives are by p, q, dp, dq. p, q: a point of the line, from the rectangle's middle; dp, dq: its direction; hp,
    hq: half of the sides.
    """
    length = math.sqrt(dp * dp + dq * dq + 1e-12)
    side = 1.0 if p * dq > q * dp else -1.0
    up, uq = 1.0 if dp > 0.0 else -1.0, 1.0 if dq > 0.0 else -1.0
    gap = (side * (p * dq - q * dp) - hp * uq * dq - hq * up * dp) / length
    shorter = gap / (length * length)
    return (
        gap,
        side * dq / length,
        -side * dp / length,
        -(side * q + hq * up) / length - shorter * dp,
        (side * p - hp * uq) / length - shorter * dq,
    )


@kernel()
def sight(boxes: Rows[BoxRow], width: float, ex: float, ey: float, ez: float, x: float, y: float, z: float) -> Sight:
    """Return the share of exposures in which no box hides a point from an eye [m; world].

    A segment meets a box unless one of six directions separates them: those of the box's edges, and those across an
    edge and the segment (separating axes). Each gap is a soft limit with the given width [m].
    """
    a, mx, my, mz, dx, dy, dz = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    hx, hy, hz = 0.5 * (x - ex), 0.5 * (y - ey), 0.5 * (z - ez)
    sx, sy, sz = 1.0 if hx > 0.0 else -1.0, 1.0 if hy > 0.0 else -1.0, 1.0 if hz > 0.0 else -1.0
    for k in range(boxes.shape[0]):
        box = boxes[k]
        half = box.half
        px, py, pz = ex + hx - box.middle[0], ey + hy - box.middle[1], ez + hz - box.middle[2]
        ux, uy, uz = 1.0 if px > 0.0 else -1.0, 1.0 if py > 0.0 else -1.0, 1.0 if pz > 0.0 else -1.0
        g0, g1, g2 = ux * px - half[0] - sx * hx, uy * py - half[1] - sy * hy, uz * pz - half[2] - sz * hz
        if max(g0, max(g1, g2)) > _CLEAR * width:
            continue
        g3, p3, q3, dp3, dq3 = passing(py, pz, hy, hz, half[1], half[2])
        g4, p4, q4, dp4, dq4 = passing(px, pz, hx, hz, half[0], half[2])
        g5, p5, q5, dp5, dq5 = passing(px, py, hx, hy, half[0], half[1])
        s0, s1, s2 = share_below(g0, width), share_below(g1, width), share_below(g2, width)
        s3, s4, s5 = share_below(g3, width), share_below(g4, width), share_below(g5, width)
        hidden = s0 * s1 * s2 * s3 * s4 * s5
        slope, free = a * hidden / width, 1.0 - hidden
        c0, c1, c2 = slope * (1.0 - s0), slope * (1.0 - s1), slope * (1.0 - s2)
        c3, c4, c5 = slope * (1.0 - s3), slope * (1.0 - s4), slope * (1.0 - s5)
        a = a * free
        mx, my = mx * free + c0 * ux + c4 * p4 + c5 * p5, my * free + c1 * uy + c3 * p3 + c5 * q5
        mz = mz * free + c2 * uz + c3 * q3 + c4 * q4
        dx, dy = dx * free - c0 * sx + c4 * dp4 + c5 * dp5, dy * free - c1 * sy + c3 * dp3 + c5 * dq5
        dz = dz * free - c2 * sz + c3 * dq3 + c4 * dq4
    return Sight(
        a,
        0.5 * (mx - dx), 0.5 * (my - dy), 0.5 * (mz - dz),
        0.5 * (mx + dx), 0.5 * (my + dy), 0.5 * (mz + dz),
    )  # fmt: skip


@kernel()
def sight_map(boxes: Rows[BoxRow], eye: Vector, xs: Vector, ys: Vector, z: float) -> Matrix:
    """Return the share of `sight` for points at each place of a grid (rows: ys, columns: xs) at one height."""
    free = np.ones((ys.shape[0], xs.shape[0]))
    for j in range(ys.shape[0]):
        for i in range(xs.shape[0]):
            free[j, i] = sight(boxes, SOFT_M, eye[0], eye[1], eye[2], xs[i], ys[j], z).a
    return free


def outside_boxes(boxes: Rows[BoxRow], xs: Vector, ys: Vector, z: float) -> NDArray[np.bool_]:
    """Return whether points at each place of a grid (rows: ys, columns: xs) at one height are in no box."""
    outside = np.ones((len(ys), len(xs)), dtype=np.bool_)
    for box in boxes:
        if abs(z - box["middle"][2]) <= box["half"][2]:
            along = np.abs(xs - box["middle"][0]) <= box["half"][0]
            across = np.abs(ys - box["middle"][1]) <= box["half"][1]
            outside &= ~(across[:, None] & along[None, :])
    return outside

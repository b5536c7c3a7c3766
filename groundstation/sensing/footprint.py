"""Footprint of a robot's camera on the floor, in cells of a grid."""

import math
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import IntMatrix, IntVector, Matrix, Vector
from groundstation.kernel import kernel
from groundstation.sensing.detection import detection_map
from groundstation.sensing.models import OnboardCameraModel, Softness
from groundstation.sensing.visibility import camera_rows

HEADINGS = 12
_LEAST = 0.05  # smaller chances are not counted


@dataclass(frozen=True, slots=True)
class Footprint:
    """The cells that a robot's camera sees from the centre of a cell, for each heading: row, column, probability.

    first (HEADINGS + 1): begin of the cells of each heading; fresh: share of a view that the neighbouring one does not
    show, on average over a full turn.
    """

    rows: IntVector
    columns: IntVector
    chances: Vector
    first: IntVector
    fresh: float


def footprint_of(
    camera_model: OnboardCameraModel, cell_m: float, height_m: float, marker_m: float, soft: Softness
) -> Footprint:
    """Return the footprint of a robot's camera at one height, for markers at another."""
    camera = camera_rows([camera_model], soft)[0]
    half = math.ceil((camera_model.view.range_m + 0.5) / cell_m)
    around = np.arange(-half, half + 1, dtype=np.float64) * cell_m
    rows, columns, chances, first = [], [], [], [0]
    for heading in range(HEADINGS):
        pose = np.array([0.0, 0.0, height_m, math.tau * heading / HEADINGS])
        seen = detection_map(camera, pose, 0.0, around, around, marker_m)
        at = np.nonzero(seen > _LEAST)
        rows.append(at[0] - half)
        columns.append(at[1] - half)
        chances.append(seen[at])
        first.append(first[-1] + len(at[0]))
    all_rows, all_columns = np.concatenate(rows).astype(np.int64), np.concatenate(columns).astype(np.int64)
    different = len(np.unique(np.array([all_rows, all_columns]), axis=1).T)
    fresh = different / max(1, len(all_rows))
    return Footprint(all_rows, all_columns, np.concatenate(chances), np.array(first, dtype=np.int64), fresh)


def turn_view(footprint: Footprint) -> float:
    """Return the number of cells that a full turn shows, each weighted by its chance at the best heading."""
    half = int(max(np.abs(footprint.rows).max(initial=0), np.abs(footprint.columns).max(initial=0)))
    best = np.zeros((2 * half + 1, 2 * half + 1))
    np.maximum.at(best, (footprint.rows + half, footprint.columns + half), footprint.chances)
    return float(best.sum())


@kernel()
def seen_from(
    chances: Matrix, at_row: IntVector, at_column: IntVector,
    rows: IntVector, columns: IntVector, seen: Vector, first: IntVector,
) -> Matrix:  # fmt: skip
    """Return the probability that a picture shows the target, by stand (its cell) and heading."""
    found = np.zeros((at_row.shape[0], first.shape[0] - 1))
    for stand in range(at_row.shape[0]):
        for heading in range(first.shape[0] - 1):
            total = 0.0
            for k in range(first[heading], first[heading + 1]):
                row, column = at_row[stand] + rows[k], at_column[stand] + columns[k]
                if 0 <= row < chances.shape[0] and 0 <= column < chances.shape[1]:
                    total += chances[row, column] * seen[k]
            found[stand, heading] = total
    return found


@kernel()
def swept(
    chances: Matrix, at_row: IntMatrix, at_column: IntMatrix, headings: IntMatrix, worth: Vector,
    cells: IntMatrix, seen: Vector, first: IntVector,
) -> tuple[Matrix, Matrix]:  # fmt: skip
    """Return the chances of sweeps (n, m): on each way (n, views: its cells) with each turn (m, views: headings).

    First the sum of the chances to see the target, each times the worth of its view, then without worth. Cells that one
    view shows count as seen for the next. cells (2, k: row, column), seen, first: of a footprint.
    """
    views, most = at_row.shape[1], 0
    for heading in range(first.shape[0] - 1):
        most = max(most, first[heading + 1] - first[heading])
    left = chances.copy()
    changed = np.empty((views * most, 2), dtype=np.int64)
    value = np.zeros((at_row.shape[0], headings.shape[0]))
    found = np.zeros((at_row.shape[0], headings.shape[0]))
    for way in range(at_row.shape[0]):
        for manner in range(headings.shape[0]):
            count = 0
            for view in range(views):
                heading, total = headings[manner, view], 0.0
                for k in range(first[heading], first[heading + 1]):
                    row, column = at_row[way, view] + cells[0, k], at_column[way, view] + cells[1, k]
                    if 0 <= row < left.shape[0] and 0 <= column < left.shape[1]:
                        gain = left[row, column] * seen[k]
                        left[row, column] -= gain
                        total += gain
                        changed[count, 0], changed[count, 1] = row, column
                        count += 1
                value[way, manner] += worth[view] * total
                found[way, manner] += total
            for k in range(count):
                row, column = changed[k, 0], changed[k, 1]
                left[row, column] = chances[row, column]
    return value, found

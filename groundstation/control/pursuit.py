"""Sweeps towards a target that was carried off: cells that the team passes on its way count as seen."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from groundstation.arrays import Array, BoolArray, IntMatrix, Vector
from groundstation.control.search_parameters import SearchParameters
from groundstation.control.sweeps import Compared, Kind, Lattice, Sweep, choose, headings, on_the_way
from groundstation.sensing.footprint import Footprint, swept

# Views of a sweep that count: 660 degrees, 11 s. In the time of each about three pictures are searched.
_VIEWS, _PICTURES = 22, 3
# Stands that are compared: their distances, and the number of directions.
_WAYS_M, _BEARINGS = (0.8, 2.0, 4.0), 12


@dataclass(frozen=True, slots=True)
class _Searcher:
    """One robot that may look for the target: paths and headings of its sweeps, and its permitted stands.

    seen: chance that a target in each cell of its footprint is found within a view; rows, columns (n, _VIEWS): cells of
    the grid on the way to each stand; headings (2, _VIEWS): as numbers, by direction; free, near (n): its permitted
    stands, and those that are compared if permitted.
    """

    footprint: Footprint
    seen: Vector
    yaw_rad: float
    rows: IntMatrix
    columns: IntMatrix
    headings: IntMatrix
    free: BoolArray
    near: BoolArray
    kept: Sweep | None

    def compare(self, left: Array, free: BoolArray, worth: Array) -> Compared:
        """Return the promise of the free stands about it, view by view; of all free ones if none about it is free."""
        near = free & self.near
        stands = np.flatnonzero(near if near.any() else free)
        footprint = self.footprint
        cells = (np.stack((footprint.rows, footprint.columns)), self.seen, footprint.first)
        return Compared(stands, *swept(left, self.rows[stands], self.columns[stands], self.headings, worth, *cells))

    def views(self, stand: int, turn: int) -> Iterator[tuple[int, int, int]]:
        """Return the cell of each view on the way, and its heading."""
        cells = self.rows[stand].tolist(), self.columns[stand].tolist()
        return zip(*cells, self.headings[turn].tolist(), strict=True)


def _searcher(
    footprint: Footprint,
    lattice: Lattice,
    pose: Array,
    allowed_s: Array,
    held: Sweep | None,
    parameters: SearchParameters,
) -> _Searcher:
    flight_s, places = on_the_way(lattice, pose, _VIEWS, parameters)
    (rows, columns), yaw_rad = lattice.cells(places), float(pose[3])
    near = np.zeros(len(flight_s), dtype=np.bool_)
    near[lattice.nearest(pose[:2] + _around())] = True
    if held is not None:
        near[held.stand] = True
    return _Searcher(
        footprint=footprint,
        seen=1.0 - (1.0 - footprint.chances) ** _PICTURES,
        yaw_rad=yaw_rad,
        rows=rows,
        columns=columns,
        headings=headings(yaw_rad, _VIEWS),
        free=flight_s + parameters.look_s <= allowed_s,
        near=near,
        kept=held,
    )


def _around() -> Array:
    """Return the places about a robot that it may fly to, including its own (n, 2) [m; from the robot]."""
    bearings = np.arange(_BEARINGS) * (math.tau / _BEARINGS)
    ring = np.column_stack((np.cos(bearings), np.sin(bearings)))
    return np.concatenate((np.zeros((1, 2)), *(way_m * ring for way_m in _WAYS_M)))


# Arguments and result: as `choose`. Fewer stands are compared, but by their whole way and more of the views after it.
choose_pursuit = partial(choose, Kind(_VIEWS, _searcher))

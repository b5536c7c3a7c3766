"""Sweeps towards a target that was carried off: what a team will have seen on its way counts as seen."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array, BoolArray, IntMatrix, Vector
from groundstation.control.coverage import (
    LEAD_RAD,
    NO_OUTLOOK,
    STEP_RAD,
    Lattice,
    Outlook,
    Sweep,
    in_best_order,
    mark_seen,
    times_s,
)
from groundstation.control.search_parameters import SearchParameters
from groundstation.control.stand import Stand
from groundstation.sensing.footprint import HEADINGS, Footprint, swept

# Views of a sweep that count: 660 degrees, 11 s. In the time of each about three pictures are searched.
_VIEWS, _PICTURES = 22, 3
_DIRECTIONS = (1, -1)
# Stands that are compared: how far away, and in how many directions.
_WAYS_M, _BEARINGS = (0.8, 2.0, 4.0), 12


def choose_pursuit(
    chances: Array,
    lattice: Lattice,
    footprints: Mapping[str, Footprint],
    poses: Mapping[str, Array],
    allowed_s: Mapping[str, Array],
    held: Mapping[str, Sweep],
    parameters: SearchParameters,
) -> Outlook:
    """Return a sweep for each robot that has a footprint, as `coverage.choose_stands` does; arguments: as there.

    Fewer stands are compared, all the way to them and more of what follows.
    """
    if not len(lattice.places):
        return NO_OUTLOOK
    searchers = {
        name: _searcher(footprint, lattice, poses[name], allowed_s[name], held.get(name), parameters)
        for name, footprint in footprints.items()
    }
    return in_best_order(searchers, lambda ordered: _chosen(np.array(chances), lattice, ordered, parameters))


@dataclass(frozen=True, slots=True)
class _Searcher:
    """One robot that may look: on which ways to stands it will, at which headings, and where it may be.

    seen: chance of each cell of its footprint to be found within a view; rows, columns (n, _VIEWS): cells of the grid
    on the way to each stand; headings (2, _VIEWS): as numbers, by direction; free, near (n): where it may be, and which
    stands are compared if it may be there.
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


def _searcher(
    footprint: Footprint,
    lattice: Lattice,
    pose: Array,
    allowed_s: Array,
    held: Sweep | None,
    parameters: SearchParameters,
) -> _Searcher:
    ways = lattice.places - pose[:2]
    flight_s = np.hypot(*ways.T) / parameters.speed_m_s
    share = np.minimum(1.0, times_s(_VIEWS, parameters) / np.maximum(flight_s, 1e-9)[:, None])
    cells = lattice.cells(pose[:2] + share[:, :, None] * ways[:, None, :])
    yaw_rad = float(pose[3])
    near = np.zeros(len(flight_s), dtype=np.bool_)
    near[lattice.nearest(pose[:2] + _around())] = True
    if held is not None:
        near[held.stand] = True
    return _Searcher(
        footprint=footprint,
        seen=1.0 - (1.0 - footprint.chances) ** _PICTURES,
        yaw_rad=yaw_rad,
        rows=cells[0],
        columns=cells[1],
        headings=(round(yaw_rad / STEP_RAD) + np.outer(_DIRECTIONS, np.arange(1, _VIEWS + 1))) % HEADINGS,
        free=flight_s + parameters.look_s <= allowed_s,
        near=near,
        kept=held,
    )


def _chosen(left: Array, lattice: Lattice, searchers: Mapping[str, _Searcher], parameters: SearchParameters) -> Outlook:
    """Return what robots that choose in this order choose; left: of the chances, changed."""
    stands: dict[str, Stand] = {}
    sweeps: dict[str, Sweep] = {}
    missed, total = 1.0, 0.0
    seen_s = times_s(_VIEWS, parameters)
    worth = np.exp(-seen_s / parameters.patience_s)
    for name, searcher in searchers.items():
        free = searcher.free.copy()
        for other in stands.values():
            free &= np.hypot(*(lattice.places - (other.x, other.y)).T) >= parameters.apart_m
        compared = np.flatnonzero(free & searcher.near if (free & searcher.near).any() else free)
        if not compared.size:
            continue
        footprint, rows, columns = searcher.footprint, searcher.rows[compared], searcher.columns[compared]
        cells = (np.stack((footprint.rows, footprint.columns)), searcher.seen, footprint.first)
        value, found = swept(left, rows, columns, searcher.headings, worth, *cells)
        if searcher.kept is not None:
            value[compared == searcher.kept.stand, _DIRECTIONS.index(searcher.kept.direction)] *= parameters.keep_gain
        best, turn = divmod(int(np.argmax(value)), len(_DIRECTIONS))
        sweep = sweeps[name] = Sweep(int(compared[best]), _DIRECTIONS[turn])
        x, y = lattice.places[sweep.stand].tolist()
        stands[name] = Stand(x, y, searcher.yaw_rad + sweep.direction * LEAD_RAD, turn_rad_s=parameters.yaw_rate_rad_s)
        missed *= 1.0 - min(1.0, float(found[best, turn]))
        total += float(value[best, turn])
        for view, heading in enumerate(searcher.headings[turn].tolist()):
            at = int(rows[best, view]), int(columns[best, view])
            mark_seen(left, footprint, searcher.seen, at, heading)
    return Outlook(stands, sweeps, 1.0 - missed, float(seen_s[-1]), total) if stands else NO_OUTLOOK


def _around() -> Array:
    """Return the places about a robot that it may fly to, and its own (n, 2) [m; from itself]."""
    bearings = np.arange(_BEARINGS) * (math.tau / _BEARINGS)
    ring = np.column_stack((np.cos(bearings), np.sin(bearings)))
    return np.concatenate((np.zeros((1, 2)), *(way_m * ring for way_m in _WAYS_M)))

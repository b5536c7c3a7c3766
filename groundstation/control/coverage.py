"""Sweeps from which a team sees most of where a lost target may be, soonest: robots turn while they fly somewhere."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import TypeVar

import numpy as np

from groundstation.arrays import Array, BoolArray, IntArray, IntVector
from groundstation.control.search_parameters import SearchParameters
from groundstation.control.stand import Stand
from groundstation.estimation.room_map import RoomGrid
from groundstation.sensing.footprint import HEADINGS, Footprint, seen_from

Searcher = TypeVar("Searcher")
_ANY_ORDER = 3  # of so many robots any may choose first
STEP_RAD = math.tau / HEADINGS
# Views of a sweep that count: the next 300 degrees, about 6.5 s.
_VIEWS = 10
_DIRECTIONS = (1, -1)
# How far ahead of a robot the heading is that it turns to: too far to slow down for.
LEAD_RAD = 0.5 * math.pi


@dataclass(frozen=True, slots=True)
class Lattice:
    """The stands that are considered, a rectangle by rows: their cells, and their places (n, 2) [m; world].

    cell_m: side of a cell.
    """

    rows: IntVector
    columns: IntVector
    places: Array
    cell_m: float

    def nearest(self, places: Array) -> IntVector:
        """Return the stand nearest to each place (..., 2)."""
        xs, ys = np.unique(self.places[:, 0]), np.unique(self.places[:, 1])
        column = np.abs(places[..., :1] - xs).argmin(axis=-1)
        row = np.abs(places[..., 1:] - ys).argmin(axis=-1)
        return np.asarray(row * len(xs) + column, dtype=np.int64)

    def cells(self, places: Array) -> tuple[IntArray, IntArray]:
        """Return row and column of the cell of each place (..., 2)."""
        offset = np.rint((places - self.places[0]) / self.cell_m).astype(np.int64)
        return self.rows[0] + offset[..., 1], self.columns[0] + offset[..., 0]


def lattice_of(grid: RoomGrid, parameters: SearchParameters) -> Lattice:
    """Return every other cell of a grid that lies well inside the fence."""
    (x0, x1), (y0, y1), inset = parameters.fence_x_m, parameters.fence_y_m, parameters.fence_inset_m
    cells = [
        (row, column, x, y)
        for row, y in enumerate(grid.ys.tolist())
        for column, x in enumerate(grid.xs.tolist())
        if row % 2 == column % 2 == 0 and x0 + inset <= x <= x1 - inset and y0 + inset <= y <= y1 - inset
    ]
    rows, columns, xs, ys = zip(*cells, strict=True) if cells else ((), (), (), ())
    places = np.array([xs, ys], dtype=np.float64).T
    return Lattice(np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64), places, grid.cell_m)


@dataclass(frozen=True, slots=True)
class Sweep:
    """What one robot does: the stand of the lattice that it flies to, and which way it turns (1: left, -1: right)."""

    stand: int
    direction: int


@dataclass(frozen=True, slots=True)
class Outlook:
    """The chosen sweeps, with the stands that bring them about, and the chance to see the target within `after_s`.

    value: sum of the chances, each the less worth the later.
    """

    stands: Mapping[str, Stand]
    sweeps: Mapping[str, Sweep]
    chance: float
    after_s: float
    value: float = 0.0


NO_OUTLOOK = Outlook({}, {}, 0.0, math.inf)


def choose_stands(
    chances: Array,
    lattice: Lattice,
    footprints: Mapping[str, Footprint],
    poses: Mapping[str, Array],
    allowed_s: Mapping[str, Array],
    held: Mapping[str, Sweep],
    parameters: SearchParameters,
) -> Outlook:
    """Return a sweep for each robot that has a footprint: in turn, that with the best chances at the earliest times.

    poses: x, y, z, yaw; allowed_s: by stand, within how long a robot may be there (negative: not at all); held: the
    sweeps so far, which are kept unless another is clearly better. No two stands are within the distance `apart_m`.
    Of few robots, whoever had better choose first does; the first in the order of `footprints` if that is the same.
    """
    if not len(lattice.places):
        return NO_OUTLOOK
    searchers = {
        name: _searcher(footprint, lattice, poses[name], allowed_s[name], held.get(name), parameters)
        for name, footprint in footprints.items()
    }
    return in_best_order(searchers, lambda ordered: _chosen(np.array(chances), lattice, ordered, parameters))


def in_best_order(searchers: Mapping[str, Searcher], chosen: Callable[[Mapping[str, Searcher]], Outlook]) -> Outlook:
    """Return what robots choose that choose in the best order; of more than three: in the order given."""
    orders = permutations(searchers) if len(searchers) <= _ANY_ORDER else (tuple(searchers),)
    outlooks = [chosen({name: searchers[name] for name in order}) for order in orders]
    return max(outlooks, key=lambda outlook: outlook.value)


@dataclass(frozen=True, slots=True)
class _Searcher:
    """One robot that may look: from which stands it will, at which headings, and where it may be.

    at (n, _VIEWS): stand nearest to where it is at each view of the sweep to a stand; heading: its own, as a number.
    """

    footprint: Footprint
    yaw_rad: float
    at: IntVector
    heading: int
    free: BoolArray
    kept: Sweep | None

    def headings(self, direction: int) -> IntVector:
        """Return the heading of each view."""
        return (self.heading + direction * np.arange(1, _VIEWS + 1, dtype=np.int64)) % HEADINGS


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
    free = flight_s + parameters.look_s <= allowed_s
    share = np.minimum(1.0, times_s(_VIEWS, parameters) / np.maximum(flight_s, 1e-9)[:, None])
    at = lattice.nearest(pose[:2] + share[:, :, None] * ways[:, None, :])
    yaw_rad = float(pose[3])
    return _Searcher(footprint, yaw_rad, at, round(yaw_rad / STEP_RAD), free, held)


def _chosen(left: Array, lattice: Lattice, searchers: Mapping[str, _Searcher], parameters: SearchParameters) -> Outlook:
    """Return what robots that choose in this order choose; left: of the chances, changed."""
    stands: dict[str, Stand] = {}
    sweeps: dict[str, Sweep] = {}
    missed, total = 1.0, 0.0
    seen_s = times_s(_VIEWS, parameters)
    worth = np.exp(-seen_s / parameters.patience_s)
    for name, searcher in searchers.items():
        footprint, free = searcher.footprint, searcher.free.copy()
        for other in stands.values():
            free &= np.hypot(*(lattice.places - (other.x, other.y)).T) >= parameters.apart_m
        if not free.any():
            continue
        cells = (footprint.rows, footprint.columns, footprint.chances, footprint.first)
        seen = footprint.fresh * seen_from(left, lattice.rows, lattice.columns, *cells)
        views = np.stack([seen[searcher.at, searcher.headings(way)] for way in _DIRECTIONS], axis=1)
        value = np.where(free[:, None], views @ worth, -1.0)
        if searcher.kept is not None:
            value[searcher.kept.stand, _DIRECTIONS.index(searcher.kept.direction)] *= parameters.keep_gain
        stand, way = divmod(int(np.argmax(value)), len(_DIRECTIONS))
        sweep = sweeps[name] = Sweep(stand, _DIRECTIONS[way])
        x, y = lattice.places[stand].tolist()
        stands[name] = Stand(x, y, searcher.yaw_rad + sweep.direction * LEAD_RAD, turn_rad_s=parameters.yaw_rate_rad_s)
        missed *= 1.0 - min(1.0, float(views[stand, way].sum()))
        total += float(value[stand, way])
        for view, heading in zip(searcher.at[stand], searcher.headings(sweep.direction), strict=True):
            at = int(lattice.rows[view]), int(lattice.columns[view])
            mark_seen(left, footprint, footprint.chances, at, int(heading))
    return Outlook(stands, sweeps, 1.0 - missed, float(seen_s[-1]), total) if stands else NO_OUTLOOK


def times_s(views: int, parameters: SearchParameters) -> Array:
    """Return when so many views of a sweep are seen [s]."""
    return np.arange(1.0, views + 1) * (STEP_RAD / parameters.yaw_rate_rad_s)


def mark_seen(left: Array, footprint: Footprint, seen: Array, at: tuple[int, int], heading: int) -> None:
    """Take what one view finds from the chances that are left; seen: of each cell of the footprint; at: row, column."""
    part = slice(int(footprint.first[heading]), int(footprint.first[heading + 1]))
    rows, columns = at[0] + footprint.rows[part], at[1] + footprint.columns[part]
    inside = (rows >= 0) & (rows < left.shape[0]) & (columns >= 0) & (columns < left.shape[1])
    left[rows[inside], columns[inside]] *= 1.0 - seen[part][inside]


def robots_in_order(robots: Sequence[str], chances: Array, poses: Mapping[str, Array], grid: RoomGrid) -> list[str]:
    """Return robots, the one first that is nearest to where the target is expected."""
    centre = (float(chances.sum(axis=0) @ grid.xs), float(chances.sum(axis=1) @ grid.ys))
    return sorted(robots, key=lambda name: (math.dist(poses[name][:2], centre), name))

"""A team's choice of sweeps: robots in turn, each the best sweep of the cells that earlier ones leave unseen.

A robot turns while it flies to a stand. Its `Searcher` defines the stands that are compared, and their promise.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import permutations
from typing import NamedTuple, Protocol

import numpy as np

from groundstation.arrays import Array, BoolArray, IntArray, IntMatrix, IntVector
from groundstation.control.search_parameters import SearchParameters
from groundstation.control.stand import Stand
from groundstation.estimation.room_map import RoomGrid
from groundstation.sensing.footprint import HEADINGS, Footprint
from groundstation.vectors import Interval

_ANY_ORDER = 3  # with up to this many robots, any may choose first
_STEP_RAD = math.tau / HEADINGS
DIRECTIONS = (1, -1)
# Lead of the commanded heading over a robot's heading: too far for the robot to slow down.
_LEAD_RAD = 0.5 * math.pi


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
    """Return every other cell of a grid that lies well inside the fence; a narrow fence has one row at least."""
    inset_m = parameters.fence_inset_m
    columns, xs = _along(grid.xs, parameters.fence_x_m, inset_m)
    rows, ys = _along(grid.ys, parameters.fence_y_m, inset_m)
    places = np.array([np.tile(xs, len(ys)), np.repeat(ys, len(xs))], dtype=np.float64).T
    return Lattice(np.repeat(rows, len(xs)), np.tile(columns, len(ys)), places, grid.cell_m)


def _along(centres: Array, fence_m: Interval, inset_m: float) -> tuple[IntVector, Array]:
    """Return the numbers of the cells along one axis that have stands, and the stands' places [m].

    Every other cell misses a narrow fence by chance, and the centre of a large cell may lie outside of one.
    """
    low, high = fence_m[0] + inset_m, fence_m[1] - inset_m
    inside = np.flatnonzero((low <= centres) & (centres <= high))
    chosen = inside[inside % 2 == 0]
    if not len(chosen):
        chosen = inside
    if len(chosen):
        return chosen, centres[chosen]
    middle = 0.5 * (low + high)
    return np.array([np.abs(centres - middle).argmin()], dtype=np.int64), np.array([middle])


@dataclass(frozen=True, slots=True)
class Sweep:
    """A robot's sweep: the stand of the lattice that it flies to, and its direction of turn (1: left, -1: right)."""

    stand: int
    direction: int


@dataclass(frozen=True, slots=True)
class Outlook:
    """The chosen sweeps, with their stands, and the chance that the target is seen within `after_s`.

    value: sum of the chances, discounted by their time.
    """

    stands: Mapping[str, Stand]
    sweeps: Mapping[str, Sweep]
    chance: float
    after_s: float
    value: float = 0.0


NO_OUTLOOK = Outlook({}, {}, 0.0, math.inf)


class Compared(NamedTuple):
    """Stands that a robot may fly to (n), the worth of their sweeps by direction (n, 2), and the chances to find."""

    stands: IntVector
    worth: Array
    found: Array


class Searcher(Protocol):
    """A robot that may look for the target.

    seen: chance that a target in each cell of its footprint is found within a view; free (n): its permitted stands;
    kept: its sweep so far.
    """

    @property
    def footprint(self) -> Footprint:
        """Return its camera's footprint on the floor."""

    @property
    def seen(self) -> Array:
        """Return the chances."""

    @property
    def yaw_rad(self) -> float:
        """Return its heading."""

    @property
    def free(self) -> BoolArray:
        """Return its permitted stands."""

    @property
    def kept(self) -> Sweep | None:
        """Return its sweep so far."""

    def compare(self, left: Array, free: BoolArray, worth: Array) -> Compared:
        """Return the promise of the stands still free; left: remaining chances of the cells; worth: of each view."""

    def views(self, stand: int, turn: int) -> Iterable[tuple[int, int, int]]:
        """Return the views of a sweep: row and column of the robot's cell, and its heading as a number."""


class Kind(NamedTuple):
    """A way to choose sweeps: the number of their views that count, and the function that makes a robot's searcher.

    searcher: of footprint, lattice, pose, allowed times, sweep so far and parameters.
    """

    views: int
    searcher: Callable[[Footprint, Lattice, Array, Array, Sweep | None, SearchParameters], Searcher]


def choose(
    kind: Kind,
    chances: Array,
    lattice: Lattice,
    footprints: Mapping[str, Footprint],
    poses: Mapping[str, Array],
    allowed_s: Mapping[str, Array],
    held: Mapping[str, Sweep],
    parameters: SearchParameters,
) -> Outlook:
    """Return a sweep for each robot with a footprint: in turn, the one with the best chances at the earliest times.

    poses: x, y, z, yaw; allowed_s: by stand, the latest time at which a robot may be there (negative: never); held: the
    sweeps so far, which are kept unless another is clearly better. No two stands are within the distance `apart_m`.
    With few robots the best choice of the first one is taken; if all are equal, the first in the order of `footprints`.
    """
    searchers = {
        name: kind.searcher(footprint, lattice, poses[name], allowed_s[name], held.get(name), parameters)
        for name, footprint in footprints.items()
    }
    orders = permutations(searchers) if len(searchers) <= _ANY_ORDER else (tuple(searchers),)
    outlooks = [
        _chosen(np.array(chances), lattice, {name: searchers[name] for name in order}, kind.views, parameters)
        for order in orders
    ]
    return max(outlooks, key=lambda outlook: outlook.value)


def _chosen(
    left: Array, lattice: Lattice, searchers: Mapping[str, Searcher], views: int, parameters: SearchParameters
) -> Outlook:
    """Return the sweeps of robots that choose in this order; left: remaining chances of the cells, changed in place."""
    stands: dict[str, Stand] = {}
    sweeps: dict[str, Sweep] = {}
    missed, total = 1.0, 0.0
    seen_s = times_s(views, parameters)
    worth = np.exp(-seen_s / parameters.patience_s)
    for name, searcher in searchers.items():
        free = searcher.free.copy()
        for other in stands.values():
            free &= np.hypot(*(lattice.places - (other.x, other.y)).T) >= parameters.apart_m
        if not free.any():
            continue
        compared, value, found = searcher.compare(left, free, worth)
        if (kept := searcher.kept) is not None:
            value[compared == kept.stand, DIRECTIONS.index(kept.direction)] *= parameters.keep_gain
        best, turn = divmod(int(np.argmax(value)), len(DIRECTIONS))
        sweep = sweeps[name] = Sweep(int(compared[best]), DIRECTIONS[turn])
        x, y = lattice.places[sweep.stand].tolist()
        yaw = searcher.yaw_rad + sweep.direction * _LEAD_RAD
        stands[name] = Stand(x, y, yaw, turn_rad_s=parameters.yaw_rate_rad_s)
        missed *= 1.0 - min(1.0, float(found[best, turn]))
        total += float(value[best, turn])
        for row, column, heading in searcher.views(sweep.stand, turn):
            _mark_seen(left, searcher, row, column, heading)
    return Outlook(stands, sweeps, 1.0 - missed, float(seen_s[-1]), total) if stands else NO_OUTLOOK


def times_s(views: int, parameters: SearchParameters) -> Array:
    """Return the times of a sweep's views [s]."""
    return np.arange(1.0, views + 1) * (_STEP_RAD / parameters.yaw_rate_rad_s)


def on_the_way(lattice: Lattice, pose: Array, views: int, parameters: SearchParameters) -> tuple[Array, Array]:
    """Return the flight time to each stand (n) [s], and the robot's place at each view of its sweep (n, views, 2)."""
    ways = lattice.places - pose[:2]
    flight_s = np.hypot(*ways.T) / parameters.speed_m_s
    share = np.minimum(1.0, times_s(views, parameters) / np.maximum(flight_s, 1e-9)[:, None])
    return flight_s, pose[:2] + share[:, :, None] * ways[:, None, :]


def headings(yaw_rad: float, views: int) -> IntMatrix:
    """Return the heading of each view (2, views), as numbers, by direction."""
    return (round(yaw_rad / _STEP_RAD) + np.outer(DIRECTIONS, np.arange(1, views + 1))) % HEADINGS


def _mark_seen(left: Array, searcher: Searcher, row: int, column: int, heading: int) -> None:
    """Subtract the chances found by one view from those left for the robots that choose later."""
    footprint = searcher.footprint
    part = slice(int(footprint.first[heading]), int(footprint.first[heading + 1]))
    rows, columns = row + footprint.rows[part], column + footprint.columns[part]
    inside = (rows >= 0) & (rows < left.shape[0]) & (columns >= 0) & (columns < left.shape[1])
    left[rows[inside], columns[inside]] *= 1.0 - searcher.seen[part][inside]

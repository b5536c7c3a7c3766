"""Stands from which a team sees most of where a lost target may be, soonest."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from groundstation.arrays import Array, BoolArray, IntVector
from groundstation.control.search_parameters import SearchParameters
from groundstation.control.stand import Stand
from groundstation.estimation.room_map import RoomGrid
from groundstation.geometry.angles import difference
from groundstation.sensing.footprint import HEADINGS, Footprint, seen_from

_ANY_ORDER = 3  # of so many robots any may choose first


@dataclass(frozen=True, slots=True)
class Lattice:
    """The stands that are considered: their cells, and their places (n, 2) [m; world]."""

    rows: IntVector
    columns: IntVector
    places: Array


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
    return Lattice(np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64), places)


@dataclass(frozen=True, slots=True)
class Outlook:
    """The chosen viewpoints, with the chance to see the target there, and the time of arrival [s].

    value: sum of the chances, each the less worth the later.
    """

    stands: Mapping[str, Stand]
    chance: float
    after_s: float
    value: float = 0.0


def choose_stands(
    chances: Array,
    lattice: Lattice,
    footprints: Mapping[str, Footprint],
    poses: Mapping[str, Array],
    allowed_s: Mapping[str, Array],
    held: Mapping[str, Stand],
    parameters: SearchParameters,
) -> Outlook:
    """Return a viewpoint for each robot that has a footprint: in turn, the best chance at the earliest time.

    poses: x, y, z, yaw; allowed_s: by stand, within how long a robot may be there (negative: not at all); held: the
    stands so far, which are kept unless another is clearly better. No two stands are within the distance `apart_m`.
    Of few robots, whoever had better choose first does; the first in the order of `footprints` if that is the same.
    """
    searchers = {
        name: _searcher(footprint, lattice, poses[name], allowed_s[name], held.get(name), parameters)
        for name, footprint in footprints.items()
    }
    orders = permutations(searchers) if len(searchers) <= _ANY_ORDER else (tuple(searchers),)
    outlooks = [
        _chosen(np.array(chances), lattice, {name: searchers[name] for name in order}, parameters) for order in orders
    ]
    return max(outlooks, key=lambda outlook: outlook.value)


@dataclass(frozen=True, slots=True)
class _Searcher:
    """One robot that may look: how long it needs to each stand and heading [s], where it may be, where it looks now."""

    footprint: Footprint
    way_s: Array
    free: BoolArray
    kept: tuple[int, int] | None


def _searcher(
    footprint: Footprint,
    lattice: Lattice,
    pose: Array,
    allowed_s: Array,
    held: Stand | None,
    parameters: SearchParameters,
) -> _Searcher:
    way_s = _way_s(pose, lattice.places, parameters)
    free = way_s.min(axis=1) <= allowed_s
    return _Searcher(footprint, way_s, free, None if held is None else _nearest(held, lattice))


def _chosen(left: Array, lattice: Lattice, searchers: Mapping[str, _Searcher], parameters: SearchParameters) -> Outlook:
    """Return what robots that choose in this order choose; left: of the chances, changed."""
    stands: dict[str, Stand] = {}
    missed, soonest, total = 1.0, math.inf, 0.0
    for name, searcher in searchers.items():
        footprint, way_s, free = searcher.footprint, searcher.way_s, searcher.free.copy()
        cells = (footprint.rows, footprint.columns, footprint.chances, footprint.first)
        seen = seen_from(left, lattice.rows, lattice.columns, *cells)
        value = seen * np.exp(-way_s / parameters.patience_s)
        for other in stands.values():
            free &= np.hypot(*(lattice.places - (other.x, other.y)).T) >= parameters.apart_m
        if not free.any():
            continue
        value = np.where(free[:, None], value, -1.0)
        if searcher.kept is not None:
            value[searcher.kept] *= parameters.keep_gain
        stand, heading = divmod(int(np.argmax(value)), HEADINGS)
        x, y = lattice.places[stand].tolist()
        stands[name] = Stand(x, y, math.tau * heading / HEADINGS)
        missed *= 1.0 - float(seen[stand, heading])
        soonest = min(soonest, float(way_s[stand, heading]))
        total += float(value[stand, heading])
        _take(left, lattice, footprint, stand, heading)
    return Outlook(stands, 1.0 - missed, soonest if stands else math.inf, total)


def _way_s(pose: Array, places: Array, parameters: SearchParameters) -> Array:
    """Return how long a robot needs to each stand and heading (n, HEADINGS) [s]."""
    flight = np.hypot(*(places - pose[:2]).T) / parameters.speed_m_s
    turn = [abs(difference(math.tau * k / HEADINGS, float(pose[3]))) for k in range(HEADINGS)]
    slower: Array = np.maximum(flight[:, None], np.array(turn)[None, :] / parameters.yaw_rate_rad_s)
    return slower + parameters.look_s


def _nearest(stand: Stand, lattice: Lattice) -> tuple[int, int]:
    row = int(np.argmin(np.hypot(*(lattice.places - (stand.x, stand.y)).T)))
    return row, round(stand.yaw / math.tau * HEADINGS) % HEADINGS


def _take(left: Array, lattice: Lattice, footprint: Footprint, stand: int, heading: int) -> None:
    """Mark the view of a robot's viewpoint as seen, for the robots that choose after it."""
    part = slice(int(footprint.first[heading]), int(footprint.first[heading + 1]))
    rows = lattice.rows[stand] + footprint.rows[part]
    columns = lattice.columns[stand] + footprint.columns[part]
    inside = (rows >= 0) & (rows < left.shape[0]) & (columns >= 0) & (columns < left.shape[1])
    # A stand is looked from more than once: three pictures.
    left[rows[inside], columns[inside]] *= (1.0 - footprint.chances[part][inside]) ** 3


def robots_in_order(robots: Sequence[str], chances: Array, poses: Mapping[str, Array], grid: RoomGrid) -> list[str]:
    """Return robots, the one first that is nearest to where the target is expected."""
    centre = (float(chances.sum(axis=0) @ grid.xs), float(chances.sum(axis=1) @ grid.ys))
    return sorted(robots, key=lambda name: (math.dist(poses[name][:2], centre), name))

"""Sweeps by which a team soonest sees most of the floor on which a lost target may be; robots turn while they fly."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from groundstation.arrays import Array, BoolArray, IntMatrix, IntVector
from groundstation.control.search_parameters import SearchParameters
from groundstation.control.sweeps import Compared, Kind, Lattice, Sweep, choose, headings, on_the_way
from groundstation.estimation.room_map import RoomGrid
from groundstation.sensing.footprint import Footprint, seen_from

# Views of a sweep that count: the next 300 degrees, about 6.5 s.
_VIEWS = 10


@dataclass(frozen=True, slots=True)
class _Searcher:
    """One robot that may look for the target: stands and headings of its sweeps, and its permitted stands.

    at (n, _VIEWS): for the sweep to each stand, the stand nearest to the robot at each view; headings (2, _VIEWS): as
    numbers, by direction.
    """

    footprint: Footprint
    lattice: Lattice
    yaw_rad: float
    at: IntVector
    headings: IntMatrix
    free: BoolArray
    kept: Sweep | None

    @property
    def seen(self) -> Array:
        """Return for each cell of the footprint the chance that one picture shows a target there."""
        return self.footprint.chances

    def compare(self, left: Array, free: BoolArray, worth: Array) -> Compared:
        """Return the promise of the free stands: on average over a turn at the stands on the way."""
        footprint, lattice = self.footprint, self.lattice
        cells = (footprint.rows, footprint.columns, footprint.chances, footprint.first)
        seen = footprint.fresh * seen_from(left, lattice.rows, lattice.columns, *cells)
        views = np.stack([seen[self.at, headings] for headings in self.headings], axis=1)
        stands = np.flatnonzero(free)
        return Compared(stands, (views @ worth)[stands], views.sum(axis=-1)[stands])

    def views(self, stand: int, turn: int) -> Iterator[tuple[int, int, int]]:
        """Return row and column of the stand nearest to each view, and its heading."""
        at = self.at[stand]
        return zip(
            self.lattice.rows[at].tolist(),
            self.lattice.columns[at].tolist(),
            self.headings[turn].tolist(),
            strict=True,
        )


def _searcher(
    footprint: Footprint,
    lattice: Lattice,
    pose: Array,
    allowed_s: Array,
    held: Sweep | None,
    parameters: SearchParameters,
) -> _Searcher:
    flight_s, places = on_the_way(lattice, pose, _VIEWS, parameters)
    free, yaw_rad = flight_s + parameters.look_s <= allowed_s, float(pose[3])
    return _Searcher(footprint, lattice, yaw_rad, lattice.nearest(places), headings(yaw_rad, _VIEWS), free, held)


# Arguments and result: as `choose`.
choose_stands = partial(choose, Kind(_VIEWS, _searcher))


def robots_in_order(robots: Sequence[str], chances: Array, poses: Mapping[str, Array], grid: RoomGrid) -> list[str]:
    """Return the robots, first the one nearest to the expected place of the target."""
    centre = (float(chances.sum(axis=0) @ grid.xs), float(chances.sum(axis=1) @ grid.ys))
    return sorted(robots, key=lambda name: (math.dist(poses[name][:2], centre), name))

"""Probability grid of an unseen target's place: it stands there, drives about, drives on as predicted, or is hidden.

The hypotheses are kept apart: a searched cell stays empty of a standing target, but not of a driving one; a target that
drives on takes its probability along; no picture shows a hidden one. Every operation returns a new value.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array

Cells = NDArray[np.bool_]
"""Which cells of a grid count (rows: ys, columns: xs)."""

MOST_CELLS = 2400
STANDS_SHARE = 0.3
"""Prior probability that an unseen target stands."""

HIDDEN_S = 2.0
"""Mean time for which a passing person hides a target from all cameras (docs/decisions/0125)."""

# For a target seen a moment ago, but not now where it is predicted: it is there nevertheless, near, anywhere.
_THERE, _NEAR, _ANYWHERE = 0.6, 0.3, 0.1
_NEAR_M = 1.2
_OUTSIDE_M = 1.0  # rooms are measured roughly, and targets drive about their edge
_NEAR_CELLS = 1.5  # least radius of a place, in cells: `lost_at` spreads it by half a cell
_HINTED = 0.5
_HIDDEN = 0.5  # share of a target where it was predicted that is hidden: somebody stands in the way
# A passing person hides a target from cameras on two sides one after the other, rarely at once (docs/decisions/0274).
_HIDDEN_AT_ONCE = 0.1


@dataclass(frozen=True, slots=True)
class RoomGrid:
    """Square cells over the floor of a room whose origin is in the middle: their size and centres [m; world]."""

    cell_m: float
    xs: Array
    ys: Array

    @classmethod
    def over(cls, size_x_m: float, size_y_m: float, cell_m: float = 0.2) -> "RoomGrid":
        """Return the grid of a room, with larger cells where there would be too many."""
        cell_m = max(cell_m, math.sqrt(size_x_m * size_y_m / MOST_CELLS))
        return cls(cell_m, _centres(size_x_m, cell_m), _centres(size_y_m, cell_m))

    def entered(self, x: float, y: float) -> tuple[float, float]:
        """Return the point of the room that is closest to a place [m; world], or the place if it is far outside."""
        half_m = 0.5 * self.cell_m
        inside = _clipped(x, self.xs, half_m), _clipped(y, self.ys, half_m)
        return inside if math.dist(inside, (x, y)) <= _OUTSIDE_M else (x, y)

    @property
    def shape(self) -> tuple[int, int]:
        """Return (rows along y, columns along x)."""
        return len(self.ys), len(self.xs)


@dataclass(frozen=True, slots=True)
class RoomMap:
    """Probabilities by cell (rows along y, columns along x): that it stands there, drives there, goes on there as
    it was predicted, or is hidden there.

    hidden: by something that the field does not name, from all cameras; overlooked: chance that all pictures since the
    beginning would have missed a target standing there in plain view.
    """

    grid: RoomGrid
    stands: Array
    drives: Array
    goes_on: Array
    hidden: Array
    overlooked: Array

    @property
    def chances(self) -> Array:
        """Return the probability of each cell; their sum is 1."""
        return self.stands + self.drives + self.goes_on + self.hidden

    @property
    def in_view(self) -> Array:
        """Return the probability of each cell for a target in plain view, which a search can find there."""
        shown = self.stands + self.drives + self.goes_on
        return np.asarray(shown / max(float(shown.sum()), 1e-12))

    def moved(self, variance_m2: float) -> "RoomMap":
        """Return the map after a driving target moved about, which adds a variance to each axis.

        Walls keep it in. variance_m2: at most half the square of a cell.
        """
        return replace(self, drives=self._spread(self.drives, variance_m2))

    def predicted(self, rows: int, columns: int, variance_m2: float) -> "RoomMap":
        """Return the map after the prediction went on by some cells, and its variance grew, for each axis.

        The share that goes on as predicted moves along, in view or hidden; only that in view spreads. Walls keep it in.
        """
        goes_on, hidden = (_shifted(_shifted(one, 0, rows), 1, columns) for one in (self.goes_on, self.hidden))
        return replace(self, goes_on=self._spread(goes_on, variance_m2), hidden=hidden)

    def given_up(self) -> "RoomMap":
        """Return the map of a target without prediction: the share that went on as predicted drives about."""
        return replace(self, drives=self.drives + self.goes_on, goes_on=np.zeros(self.grid.shape))

    def _spread(self, values: Array, variance_m2: float) -> Array:
        share = min(0.5 * variance_m2 / self.grid.cell_m**2, 0.25)
        return _smoothed(_smoothed(values, 0, share), 1, share)

    def uncovered(self, time_s: float) -> "RoomMap":
        """Return the map after some time: the hiding object may have gone, and the target stands or goes on in view."""
        left = math.exp(-time_s / HIDDEN_S)
        shown = (1.0 - left) * self.hidden
        stands, goes_on = self.stands + STANDS_SHARE * shown, self.goes_on + (1.0 - STANDS_SHARE) * shown
        return replace(self, stands=stands, goes_on=goes_on, hidden=left * self.hidden)

    def emptied(self, chance: Array) -> "RoomMap":
        """Return the map after a picture without the target; chance: probability that it shows a target, by cell."""
        missed = 1.0 - chance
        stands, drives, goes_on = self.stands * missed, self.drives * missed, self.goes_on * missed
        total, overlooked = float((stands + drives + goes_on + self.hidden).sum()), self.overlooked * missed
        if total <= 1e-9:
            return replace(unknown_place(self.grid), overlooked=overlooked)
        return RoomMap(self.grid, stands / total, drives / total, goes_on / total, self.hidden / total, overlooked)

    def mass_near(self, mean: Sequence[float] | Array, covariance: Array, sigmas: float, least_m: float) -> float:
        """Return the probability that the target is within some standard deviations of a place, or a least distance.

        The least distance is never shorter than large cells need to hold what `lost_at` puts there. A place a little
        outside the room counts as the nearest one in it; an estimate farther out is wrong, and nothing is near it.
        """
        x, y = self.grid.entered(float(mean[0]), float(mean[1]))
        least_m = max(least_m, _NEAR_CELLS * self.grid.cell_m)
        dx, dy = self.grid.xs[None, :] - x, self.grid.ys[:, None] - y
        square = _squared_distance(dx, dy, covariance)
        near = (square <= sigmas**2) | (dx * dx + dy * dy <= least_m**2)
        return float(self.chances[near].sum())

    def excluded(self, floor: Cells) -> float:
        """Return the share of some cells that was searched: the chance to have found a target that stands there.

        Of no cells all is searched.
        """
        return 1.0 - float(np.mean(self.overlooked[floor])) if floor.any() else 1.0

    def likeliest(self, floor: Cells) -> tuple[float, float]:
        """Return the centre of the likeliest of some cells for a target that nothing hides [m; world]."""
        row, column = np.unravel_index(int(np.argmax(np.where(floor, self.in_view, -1.0))), self.grid.shape)
        return float(self.grid.xs[column]), float(self.grid.ys[row])


def unknown_place(grid: RoomGrid, hints: Sequence[tuple[float, float]] = ()) -> RoomMap:
    """Return the map of a target that was never seen: anywhere, more likely near the mean of some places."""
    even = np.full(grid.shape, 1.0 / (grid.shape[0] * grid.shape[1]))
    if not hints:
        return _shared(grid, even)
    x, y = np.mean(hints, axis=0)
    near = np.exp(-np.hypot(grid.xs[None, :] - x, grid.ys[:, None] - y) / _NEAR_M)
    return _shared(grid, _HINTED * near / near.sum() + (1.0 - _HINTED) * even)


def lost_at(grid: RoomGrid, mean: Sequence[float] | Array, covariance: Array, at_once: bool = False) -> RoomMap:
    """Return the map of a target that was predicted at a place with mean (2) and covariance (2, 2), and is unseen.

    It may be hidden there, but rarely if cameras on two sides lost it at once; or it was carried away, so places near
    to it and the whole room have their share.
    """
    dx, dy = grid.xs[None, :] - mean[0], grid.ys[:, None] - mean[1]
    wide = np.asarray(covariance) + (0.5 * grid.cell_m) ** 2 * np.eye(2)
    square = _squared_distance(dx, dy, wide)
    there = np.exp(-0.5 * (square - square.min()))
    away = np.hypot(dx, dy)
    near = np.exp(-(away - away.min()) / _NEAR_M)  # of a place far beyond the walls, the nearest cells
    there *= _THERE / there.sum()
    elsewhere = _NEAR * near / near.sum() + _ANYWHERE / there.size
    share = _HIDDEN * (_HIDDEN_AT_ONCE if at_once else 1.0)
    total = 1.0 - _THERE * (_HIDDEN - share)
    return _shared(grid, elsewhere / total, (1.0 - _HIDDEN) * there / total, share * there / total)


def _squared_distance(dx: Array, dy: Array, covariance: Array) -> Array:
    """Return the squared Mahalanobis distance of places (dx, dy) from a mean with this covariance (2, 2)."""
    xx, xy, yy = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    return np.asarray((yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy))


def _shared(grid: RoomGrid, elsewhere: Array, there: Array | float = 0.0, hidden: Array | float = 0.0) -> RoomMap:
    """Return the map of a target that is elsewhere, or there where it was predicted: in view or hidden."""
    none, drives = np.zeros(grid.shape), 1.0 - STANDS_SHARE
    stands = STANDS_SHARE * (elsewhere + there)
    return RoomMap(grid, stands, drives * elsewhere, none + drives * there, none + hidden, np.ones(grid.shape))


def _centres(size_m: float, cell_m: float) -> Array:
    count = max(1, round(size_m / cell_m))
    return (np.arange(count, dtype=np.float64) - (count - 1) / 2) * cell_m


def _clipped(value: float, centres: Array, half_m: float) -> float:
    return min(max(value, float(centres[0]) - half_m), float(centres[-1]) + half_m)


def _shifted(values: Array, axis: int, cells: int) -> Array:
    """Return values moved along an axis by some cells; at a wall they add up."""
    count = values.shape[axis]
    moved, at = np.zeros_like(values), np.clip(np.arange(count) + cells, 0, count - 1)
    np.add.at(np.moveaxis(moved, axis, 0), at, np.moveaxis(values, axis, 0))
    return moved


def _smoothed(values: Array, axis: int, share: float) -> Array:
    """Return values of which each cell gave a share to either neighbour along an axis; walls give it back."""
    padded = np.concatenate((values.take([0], axis), values, values.take([-1], axis)), axis)
    count = padded.shape[axis]
    before, after = padded.take(range(count - 2), axis), padded.take(range(2, count), axis)
    return (1.0 - 2.0 * share) * values + share * (before + after)

"""Paths of drones and targets: knots in time, joined by the motion that their own sensors measured."""

import math
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array, IntArray
from groundstation.calibration.team_record import OwnMotion, Sightings
from groundstation.field.drones import FieldDrone
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import world_from_downward_optical

ROBOT, TARGET = 6, 3
"""Entries of a knot: (x, y, z, correction of the heading, errors of roll and pitch); (x, y, heading)."""
# No multiple of the usual periods of pictures: they would all lie at the same places between knots, some of which fit
# better than others, and a suspected delay would gain by moving them there.
_SPACING_S = 0.19
LATER_S = 0.04
"""Half of the step by which derivatives by delays are taken [s]: about the size of a wrong delay.

Over a smaller step they are mostly velocity noise, which the fit would take for information on the delay.
"""


@dataclass(frozen=True, slots=True)
class Grid:
    """Times of the knots [s], evenly spaced."""

    times: Array
    spacing_s: float

    def between(self, times: Array) -> tuple[IntArray, Array]:
        """Return the knot before each time, and the share of the way to the next."""
        steps = np.clip((times - self.times[0]) / self.spacing_s, 0.0, len(self.times) - 1.000001)
        first = steps.astype(np.int64)
        return first, steps - first


def grid_of(duration_s: float, earlier: float = 0.0) -> Grid:
    """Return the knots of a recording; earlier: share of their spacing by which the first lies before its begin."""
    count = max(3, math.ceil(duration_s / _SPACING_S + earlier) + 1)
    return Grid(np.asarray(_SPACING_S * (np.arange(count) - earlier)), _SPACING_S)


class RobotPath:
    """A drone's path: `knots` (k, 6), and between them the way by its odometry."""

    def __init__(self, own: OwnMotion, drone: FieldDrone, grid: Grid, knots: Array) -> None:
        self.own, self.grid, self.knots = own, grid, knots
        self._scale, self._delay_s = drone.odometry.velocity_scale, drone.odometry.velocity_delay_ms / 1000
        self._height_delay_s = drone.odometry.height_delay_ms / 1000
        self.refresh(0.0, 0.0, 0.0, 0.0)

    def refresh(self, scale: float, later_s: float, height_later_s: float, own_later_s: float) -> None:
        """Integrate the reported velocities anew, under errors of their scale (a share) and of the delays [s].

        own_later_s: delay of attitudes, added to those of velocities and heights.
        """
        self.height_delay_s = self._height_delay_s + height_later_s + own_later_s
        self._own_later_s = own_later_s
        later_s += own_later_s
        times, after, before = self.grid.times, later_s + LATER_S, later_s - LATER_S
        self.at_knots = _along(self._way(scale, later_s), times)
        self.later_at_knots = (_along(self._way(scale, after), times) - _along(self._way(scale, before), times)) / (
            2.0 * LATER_S
        )
        self._between_knots = self._way(0.0, 0.0)
        self._between_at_knots = _along(self._between_knots, times)

    def _way(self, scale: float, later_s: float) -> tuple[Array, Array]:
        """Return times (n) and the way up to each (n, 2)."""
        own, grid = self.own, self.grid
        times = own.times - self._delay_s - later_s
        heading = self._angle(own.yaw, times) + np.interp(times, grid.times, self.knots[:, 3])
        c, s = np.cos(heading), np.sin(heading)
        vx, vy = self._scale * (1.0 + scale) * own.velocities.T
        velocity = np.column_stack((c * vx - s * vy, s * vx + c * vy))
        steps = 0.5 * np.diff(times)[:, None] * (velocity[1:] + velocity[:-1])
        return times, np.vstack((np.zeros((1, 2)), np.cumsum(steps, axis=0)))

    def bulge(self, times: Array) -> Array:
        """Return the distance of the way between two knots from their line (n, 2), as the field has the odometry.

        Most of it is the velocities' noise, a millimetre. If it moved with suspected delays, each sighting would give
        false evidence of them: e^9 for a flight at one phase of the knots, none for the same at another.
        """
        first, share = self.grid.between(times)
        return _along(self._between_knots, times) - _between(self._between_at_knots, first, share)

    def poses(self, times: Array) -> Array:
        """Return (x, y, z, yaw, roll, pitch) at times (n, 6)."""
        own, (first, share) = self.own, self.grid.between(times)
        poses = _between(self.knots, first, share)
        poses[:, :2] += self.bulge(times)
        for column, angle in ((3, own.yaw), (4, own.roll), (5, own.pitch)):
            poses[:, column] += self._angle(angle, times)
        return np.asarray(poses)

    def _angle(self, angle: Array, times: Array) -> Array:
        return np.asarray(np.interp(times + self._own_later_s, self.own.times, angle))

    def turning(self, times: Array) -> Array:
        """Return the rates of yaw, roll and pitch (n, 3) [rad/s]: their derivatives by the common delay."""
        own, step = self.own, LATER_S
        columns = [self._angle(a, times + step) - self._angle(a, times - step) for a in (own.yaw, own.roll, own.pitch)]
        return np.column_stack(columns) / (2.0 * step)


class TargetPath:
    """A target's path: `knots` (k, 3), joined by lines."""

    def __init__(self, grid: Grid, knots: Array) -> None:
        self.grid, self.knots = grid, knots

    def poses(self, times: Array) -> Array:
        """Return (x, y, 0, yaw, 0, 0) at times (n, 6)."""
        first, share = self.grid.between(times)
        poses = np.zeros((len(times), 6))
        poses[:, [0, 1, 3]] = _between(self.knots, first, share)
        return poses


def _along(way: tuple[Array, Array], times: Array) -> Array:
    return np.column_stack([np.interp(times, way[0], column) for column in way[1].T])


def _between(table: Array, first: IntArray, share: Array) -> Array:
    part = share[:, None]
    return np.asarray((1.0 - part) * table[first] + part * table[first + 1])


def robot_start(field: ResolvedField, name: str, own: OwnMotion, sightings: Sightings, grid: Grid) -> Array:
    """Return initial knots of a drone, from sightings by fixed cameras."""
    rows = [i for i, s in enumerate(sightings.subjects) if s == name and sightings.observers[i] in field.cameras]
    times, seen = sightings.times[rows], sightings.seen[rows]
    headings = np.unwrap(seen[:, 3])
    places = np.empty((len(rows), 3))
    for index, row in enumerate(rows):
        camera = field.cameras[sightings.observers[row]]
        places[index] = world_from_downward_optical(camera.rotation_deg) @ seen[index, :3] + camera.position_m
    marker = np.array(field.drones[name].marker.position_m)
    c, s = np.cos(headings), np.sin(headings)
    ahead, left, up = marker
    places -= np.column_stack((c * ahead - s * left, s * ahead + c * left, np.full(len(rows), up)))
    knots = np.zeros((len(grid.times), ROBOT))
    for column in range(3):
        knots[:, column] = _smooth(times, places[:, column], grid)
    knots[:, 3] = _heading_start(own, times, headings, grid)
    return knots


def _heading_start(own: OwnMotion, times: Array, headings: Array, grid: Grid) -> Array:
    """Return the correction of the heading at the knots, one value between two resets of the drone's own heading."""
    gap = headings - np.interp(times, own.times, own.yaw)
    block = np.interp(times, own.times, own.resets).round()
    at_knots = np.interp(grid.times, own.times, own.resets).round()
    known = {float(one): _mean_angle(gap[block == one]) for one in np.unique(block)}
    if not known:
        return np.zeros(len(grid.times))
    blocks = np.array(sorted(known))
    nearest = blocks[np.argmin(np.abs(at_knots[:, None] - blocks[None, :]), axis=1)]
    return np.array([known[float(one)] for one in nearest])


def _mean_angle(angles: Array) -> float:
    return math.atan2(float(np.median(np.sin(angles))), float(np.median(np.cos(angles))))


def target_start(times: Array, places: Array, headings: Array, grid: Grid) -> Array:
    """Return initial knots of a target, from its places by drones' sightings (n, 2) and its headings (n)."""
    turned = np.unwrap(headings)
    columns = [_smooth(times, values, grid) for values in (places[:, 0], places[:, 1], turned)]
    return np.column_stack(columns)


def _smooth(times: Array, values: Array, grid: Grid) -> Array:
    """Return medians of values about the knots, interpolated linearly across gaps."""
    first, share = grid.between(times)
    nearest = first + (share > 0.5)
    order = np.argsort(nearest, kind="stable")
    knots, starts = np.unique(nearest[order], return_index=True)
    medians = np.array([np.median(part) for part in np.split(values[order], starts[1:])])
    return np.asarray(np.interp(np.arange(len(grid.times)), knots, medians))

"""Rows of the batch: residuals in deviations with their derivatives by knots and figures, and rows that join knots."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_matrix

from groundstation.arrays import Array, IntArray, Vector
from groundstation.calibration.team_paths import RobotPath, TargetPath
from groundstation.field.drones import FieldDrone
from groundstation.vehicles import kind_named

# Rates at which a climb and a target's turn change [m/s^2], [rad/s^2]; a turning target accelerates beyond its wheels.
_CLIMB_M_S2, _TURN_RAD_S2, _TURNING_M_S2 = 0.8, 2.0, 0.3
_HEIGHT_EACH_S, _HEIGHT_LASTS_S, _LOWEST_M = 0.4, 2.0, 0.3
_RESET_RAD, _STILL, _FREEDOM = 10.0, 5e-4, 8.0
_UNHEARD_M_S = 0.5


@dataclass
class Rows:
    """Collects residuals and derivatives; `local` columns belong to knots, `figures` columns to figures.

    beyond: the cost beyond their squares, where outliers count less.
    """

    residuals: list[Vector] = field(default_factory=list)
    local: list[tuple[IntArray, IntArray, Vector]] = field(default_factory=list)
    figures: list[tuple[IntArray, IntArray, Vector]] = field(default_factory=list)
    count: int = 0
    beyond: float = 0.0

    def add(self, residual: Vector, std: Vector | float) -> tuple[IntArray, Vector]:
        """Take residuals (seen minus predicted); returns their row numbers and weights (1 over deviation)."""
        weight: Vector = np.broadcast_to(1.0 / np.asarray(std, dtype=np.float64), residual.shape).copy()
        rows = self.count + np.arange(len(residual), dtype=np.int64)
        self.residuals.append(residual * weight)
        self.count += len(residual)
        return rows, weight

    def by_knots(self, rows: IntArray, columns: IntArray, values: Vector) -> None:
        """Take derivatives of the prediction, already in deviations."""
        self.local.append((rows, columns, values))

    def by_figures(self, rows: IntArray, columns: IntArray, values: Vector) -> None:
        """Take derivatives by figures; column -1: no figure."""
        known = columns >= 0
        self.figures.append((rows[known], columns[known], values[known]))

    def count_as_one_of(self, alike: float) -> None:
        """Make every `alike` of the rows so far count as one, because they are correlated."""
        share = alike**-0.5
        self.residuals = [share * values for values in self.residuals]
        self.local = [(rows, columns, share * values) for rows, columns, values in self.local]
        self.figures = [(rows, columns, share * values) for rows, columns, values in self.figures]
        self.beyond /= alike

    def matrices(self, locals_: int, figures: int) -> tuple[Vector, csr_matrix, csr_matrix]:
        """Return residuals (m) and derivatives (m, locals), (m, figures)."""
        return (
            np.concatenate(self.residuals),
            _sparse(self.local, (self.count, locals_)),
            _sparse(self.figures, (self.count, figures)),
        )


def _sparse(entries: list[tuple[IntArray, IntArray, Vector]], shape: tuple[int, int]) -> csr_matrix:
    if not entries:
        return csr_matrix(shape)
    rows, columns, values = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    return csr_matrix((values, (rows, columns)), shape=shape)


@dataclass(frozen=True, slots=True)
class Columns:
    """The columns of one entity's knots: entry `e` of knot `k` has column first + e + stride k."""

    first: int
    stride: int

    def of(self, knots: IntArray, entry: int) -> IntArray:
        """Return the columns of one entry of knots."""
        return self.first + entry + self.stride * knots


def robot_rows(rows: Rows, path: RobotPath, drone: FieldDrone, columns: Columns, figures: Mapping[str, int]) -> None:
    """Add the rows of a drone's own sensors; figures: columns of its own figures, by part."""
    _way_rows(rows, path, drone, columns, figures)
    _heading_rows(rows, path, drone, columns)
    _lean_rows(rows, path, drone, columns)
    _bend_rows(rows, path.knots[:, 2], columns, 2, _CLIMB_M_S2 * path.grid.spacing_s**2)
    _height_rows(rows, path, drone, columns, figures)


def _way_rows(rows: Rows, path: RobotPath, drone: FieldDrone, columns: Columns, figures: Mapping[str, int]) -> None:
    habits, odometry = kind_named(drone.kind).habits, drone.odometry
    knots = np.arange(len(path.grid.times) - 1)
    told = np.diff(path.at_knots, axis=0)
    gap = told - np.diff(path.knots[:, :2], axis=0)
    std = odometry.velocity_std_m_s * np.sqrt(2.0 * habits.velocity_s * path.grid.spacing_s)
    heard = np.histogram(path.own.times, np.append(path.grid.times, np.inf))[0][:-1] > 0
    deviations = np.where(heard, std, _UNHEARD_M_S * path.grid.spacing_s)
    bent = np.column_stack((-told[:, 1], told[:, 0]))
    hasty = np.diff(path.later_at_knots, axis=0)
    for axis in range(2):
        # The report is the measurement, the step between knots its prediction.
        at, weight = rows.add(gap[:, axis], deviations)
        rows.by_knots(at, columns.of(knots, axis), -weight)
        rows.by_knots(at, columns.of(knots + 1, axis), weight)
        for knot in (knots, knots + 1):
            rows.by_knots(at, columns.of(knot, 3), -0.5 * weight * bent[:, axis])
        rows.by_figures(at, np.full(len(at), figures["scale"]), -weight * told[:, axis])
        # If attitudes are late too, the headings of these velocities turn a little; that is neglected.
        for part in ("velocity_delay", "own_delay"):
            rows.by_figures(at, np.full(len(at), figures[part]), -weight * hasty[:, axis])


def _heading_rows(rows: Rows, path: RobotPath, drone: FieldDrone, columns: Columns) -> None:
    own, grid = path.own, path.grid
    told = np.interp(grid.times[:-1], own.times, own.yaw_std)
    std = np.where(told > 0.0, told, np.radians(drone.odometry.yaw_rate_std_deg_s)) * np.sqrt(grid.spacing_s)
    reset = np.diff(np.interp(grid.times, own.times, own.resets)) > 0.0
    _step_rows(rows, path.knots[:, 3], columns, 3, np.where(reset, _RESET_RAD, std))


def _lean_rows(rows: Rows, path: RobotPath, drone: FieldDrone, columns: Columns) -> None:
    own, grid = path.own, path.grid
    lasts_s = kind_named(drone.kind).habits.attitude_s
    told = np.interp(grid.times, own.times, own.attitude_std)
    std = np.where(told > 0.0, told, drone.odometry.attitude_std_rad)
    fade = float(np.exp(-grid.spacing_s / lasts_s))
    for entry in (4, 5):
        lean = path.knots[:, entry]
        at, weight = rows.add(-lean[:1], std[:1])
        rows.by_knots(at, columns.of(np.zeros(1, dtype=np.int64), entry), weight)
        knots = np.arange(len(lean) - 1)
        at, weight = rows.add(fade * lean[:-1] - lean[1:], std[1:] * np.sqrt(1.0 - fade**2))
        rows.by_knots(at, columns.of(knots, entry), -fade * weight)
        rows.by_knots(at, columns.of(knots + 1, entry), weight)


def _height_rows(rows: Rows, path: RobotPath, drone: FieldDrone, columns: Columns, figures: Mapping[str, int]) -> None:
    own, odometry = path.own, drone.odometry
    known = np.flatnonzero(np.isfinite(own.height) & (own.height > _LOWEST_M))
    if not len(known):
        return
    spaced = known[np.unique((own.times[known] / _HEIGHT_EACH_S).astype(int), return_index=True)[1]]
    first, share = path.grid.between(own.times[spaced] - path.height_delay_s)
    z = path.knots[:, 2]
    here = (1.0 - share) * z[first] + share * z[first + 1]
    gap = own.height[spaced] - here
    std = odometry.height_std_m * np.sqrt(2.0 * _HEIGHT_LASTS_S / _HEIGHT_EACH_S)
    doubt = np.sqrt((_FREEDOM + (gap / std) ** 2) / (_FREEDOM + 1.0))
    at, weight = rows.add(gap, std * doubt)
    rows.by_knots(at, columns.of(first, 2), weight * (1.0 - share))
    rows.by_knots(at, columns.of(first + 1, 2), weight * share)
    climb = (z[first + 1] - z[first]) / path.grid.spacing_s
    for part in ("height_delay", "own_delay"):
        rows.by_figures(at, np.full(len(at), figures[part]), -weight * climb)


def target_rows(rows: Rows, path: TargetPath, acceleration_m_s2: float, columns: Columns) -> None:
    """Add the rows that limit how fast a target accelerates and turns."""
    squared = path.grid.spacing_s**2
    for entry in (0, 1):
        _bend_rows(rows, path.knots[:, entry], columns, entry, (acceleration_m_s2 + _TURNING_M_S2) * squared)
    _bend_rows(rows, path.knots[:, 2], columns, 2, _TURN_RAD_S2 * squared)


def stand_rows(
    rows: Rows, path: RobotPath, columns: Columns, span: tuple[float, float], pose: Array, std: Array
) -> None:
    """Add the rows of a drone standing still over a span.

    pose, std (4): x, y, z, heading [m, rad; world] of its pad.
    """
    knots = np.flatnonzero((path.grid.times >= span[0]) & (path.grid.times <= span[1]))
    if len(knots) < 2:
        return
    middle = knots[[len(knots) // 2]]
    here = path.poses(path.grid.times[middle])[0, :4]
    gap = pose - here
    gap[3] = np.remainder(gap[3] + np.pi, 2.0 * np.pi) - np.pi
    for entry in range(4):
        at, weight = rows.add(gap[[entry]], std[[entry]])
        rows.by_knots(at, columns.of(middle, entry), weight)
        if entry < 3:
            steps = np.diff(path.knots[knots, entry])
            at, weight = rows.add(-steps, _STILL)
            rows.by_knots(at, columns.of(knots[:-1], entry), -weight)
            rows.by_knots(at, columns.of(knots[1:], entry), weight)


def _step_rows(rows: Rows, values: Vector, columns: Columns, entry: int, std: Vector) -> None:
    knots = np.arange(len(values) - 1)
    at, weight = rows.add(-np.diff(values), std)
    rows.by_knots(at, columns.of(knots, entry), -weight)
    rows.by_knots(at, columns.of(knots + 1, entry), weight)


def _bend_rows(rows: Rows, values: Vector, columns: Columns, entry: int, std: float) -> None:
    knots = np.arange(len(values) - 2)
    at, weight = rows.add(-(values[2:] - 2.0 * values[1:-1] + values[:-2]), std)
    for offset, factor in ((0, 1.0), (1, -2.0), (2, 1.0)):
        rows.by_knots(at, columns.of(knots + offset, entry), factor * weight)

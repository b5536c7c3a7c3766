"""Fits a team's paths and its field's figures to a recording at once, by Gauss-Newton with the knots eliminated.

The normal equations of the knots are banded in time; their elimination (Schur complement) leaves the information that
the recording holds on the figures.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array, IntArray, Vector
from groundstation.calibration.team_elimination import Knots, eliminated
from groundstation.calibration.team_figures import OWN, Figures
from groundstation.calibration.team_paths import (
    LATER_S,
    ROBOT,
    TARGET,
    RobotPath,
    TargetPath,
    grid_of,
    robot_start,
    target_start,
)
from groundstation.calibration.team_record import TeamRecord
from groundstation.calibration.team_rows import Columns, Rows, robot_rows, stand_rows, target_rows
from groundstation.calibration.team_sight import Scene, looks_of, noise, off, predicted, slopes
from groundstation.calibration.team_sightings import LEAST_SEEN, only, seen_from_above, usable
from groundstation.errors import OperatorMistake
from groundstation.estimation.parameters import STAMP_STD_S
from groundstation.field.resolved import ResolvedField
from groundstation.preflight.stand import PLACED_M, PLACED_RAD, stand_of

_FREEDOM = 8.0
# The first rounds weigh outliers more, so that distant ones still attract.
_FORGIVING = (30.0, 10.0, 4.0, 2.0)
_ROUNDS, _SETTLED = 14, 0.02
# Full steps oscillate about the best common delay of all sensors, which is weakly constrained.
_DAMPED = 0.5


@dataclass(frozen=True, slots=True)
class Fit:
    """The best fit of a recording under a prior.

    theta (n): the figures' errors; information (n, n), pull (n): of the recording alone, about zero; misfit: mean
    squared deviation of a sighting's row; used: number of sightings; cost: twice the negative log likelihood of paths
    and theta, but for a constant.
    """

    theta: Vector
    information: Array
    pull: Vector
    misfit: float
    used: int
    cost: float

    def log_evidence(self, sigma: Array) -> float:
        """Return the log evidence, but for a constant, of the prior (n, n) of this fit.

        The paths must be fitted under this prior: delays bend them, so the best delay's fit says little of others.
        """
        spread = np.linalg.slogdet(np.eye(len(self.theta)) + sigma @ self.information)[1]
        prior = float(self.theta @ np.linalg.solve(sigma, self.theta))
        return -0.5 * (self.cost + prior + float(spread))


class TeamBatch:
    """One recording, ready to be fitted; raises OperatorMistake if no fixed camera saw a drone long enough.

    earlier: by which share of their spacing the knots begin before the recording.
    """

    def __init__(self, record: TeamRecord, field: ResolvedField, earlier: float = 0.0) -> None:
        grid = grid_of(record.duration_s, earlier)
        drones = [
            name for name in field.drones if name in record.own and seen_from_above(record.sightings, field, name)
        ]
        if not drones:
            raise OperatorMistake("no fixed camera saw any drone often enough: nothing to calibrate by")
        self.field, self.figures, self._record = field, Figures(field, drones), record
        self._sightings = usable(record, field, drones)
        self.robots = {
            name: RobotPath(
                record.own[name],
                field.drones[name],
                grid,
                robot_start(field, name, record.own[name], record.sightings, grid),
            )
            for name in drones
        }
        self._looks = looks_of(field, self._sightings.observers, self._sightings.subjects)
        self.targets: dict[str, TargetPath] = {}
        self._stride, self._first = 0, dict[str, int]()
        for name in drones:
            self._first[name], self._stride = self._stride, self._stride + ROBOT
        for name in field.tracked:
            path = self._target_start(name)
            if path is not None:
                self.targets[name] = path
                self._first[name], self._stride = self._stride, self._stride + TARGET
        self._keep_tracked()

    def _keep_tracked(self) -> None:
        kept = [i for i, s in enumerate(self._sightings.subjects) if s in self._first]
        self._sightings = only(self._sightings, kept)
        self._looks = looks_of(self.field, self._sightings.observers, self._sightings.subjects)

    def _target_start(self, name: str) -> TargetPath | None:
        s = self._sightings
        rows = [i for i, subject in enumerate(s.subjects) if subject == name]
        if len(rows) < LEAST_SEEN:
            return None
        places, headings = np.empty((len(rows), 2)), np.empty(len(rows))
        looks = looks_of(self.field, [s.observers[i] for i in rows], [name] * len(rows))
        for index, row in enumerate(rows):
            pose = self._pose(s.observers[row], s.times[[row]])[0]
            c, sine = np.cos(pose[3]), np.sin(pose[3])
            turn = np.array([[c, -sine, 0.0], [sine, c, 0.0], [0.0, 0.0, 1.0]])
            pan, tilt = looks.pan[index], looks.tilt[index]
            mount = np.array(
                [
                    [np.cos(pan) * np.cos(tilt), -np.sin(pan), np.cos(pan) * np.sin(tilt)],
                    [np.sin(pan) * np.cos(tilt), np.cos(pan), np.sin(pan) * np.sin(tilt)],
                    [-np.sin(tilt), 0.0, np.cos(tilt)],
                ]
            )
            seen = mount @ looks.level[index] @ s.seen[row, :3] + looks.eye[index]
            places[index], headings[index] = (pose[:3] + turn @ seen)[:2], s.seen[row, 3] + pose[3]
        grid = next(iter(self.robots.values())).grid
        return TargetPath(grid, target_start(s.times[rows], places, headings, grid))

    def _pose(self, name: str, times: Array) -> Array:
        if name in self.field.cameras:
            pose = np.zeros((len(times), 6))
            pose[:, :3] = self.field.cameras[name].position_m
            return pose
        return self._path(name).poses(times)

    def _path(self, name: str) -> RobotPath | TargetPath:
        return self.robots[name] if name in self.robots else self.targets[name]

    def fit(self, sigma: Array, alike: float = 1.0) -> Fit:
        """Return the best fit if the figures' errors have a prior with this covariance (n, n).

        alike: this many sightings count as one, because disturbances last; the precision of pads is not changed by it.
        """
        theta, precision = np.zeros(len(self.figures.keys)), np.linalg.inv(sigma)
        rounds = (*_FORGIVING, *([1.0] * _ROUNDS))
        for forgiving in rounds:
            self._refresh(theta)
            H, g, knots = self._eliminated(theta, forgiving, alike)
            step = np.asarray(np.linalg.solve(H + precision, g - precision @ theta))
            if forgiving == 1.0:
                step = _DAMPED * step
            self._take(_DAMPED * knots.step(step / _DAMPED) if forgiving == 1.0 else knots.step(step))
            theta = theta + step
            if forgiving == 1.0 and float(np.max(np.abs(step) / self.figures.surveyed)) < _SETTLED:
                break
        self._refresh(theta)
        H, g, _ = self._eliminated(theta, 1.0, alike)
        return Fit(theta, H, g + H @ theta, self._misfit, len(self._sightings.times), self._cost)

    def _refresh(self, theta: Vector) -> None:
        for name, path in self.robots.items():
            path.refresh(*(float(theta[self.figures.place[name, part]]) for part in OWN))

    def _eliminated(self, theta: Vector, forgiving: float, alike: float) -> tuple[Array, Vector, "Knots"]:
        rows = Rows()
        for name, path in self.robots.items():
            drone = self.field.drones[name]
            robot_rows(rows, path, drone, self._columns(name), {part: self.figures.place[name, part] for part in OWN})
        for name, target in self.targets.items():
            target_rows(rows, target, self.field.tracked[name].max_acceleration_m_s2, self._columns(name))
        self._sighting_rows(rows, theta, forgiving)
        rows.count_as_one_of(alike)
        self._stand_rows(rows)
        count = self._stride * len(next(iter(self.robots.values())).grid.times)
        r, local, figures = rows.matrices(count, len(theta))
        self._cost = float(r @ r) + rows.beyond
        return eliminated(r, local, figures, 3 * self._stride)

    def _stand_rows(self, rows: Rows) -> None:
        for name, span in self._record.stands.items():
            if name in self.robots:
                stand_rows(rows, self.robots[name], self._columns(name), span, *_pad(self.field, name))

    def _columns(self, name: str) -> Columns:
        return Columns(self._first[name], self._stride)

    def _take(self, step: Vector) -> None:
        table = step.reshape(-1, self._stride)
        for name, first in self._first.items():
            knots = self._path(name).knots
            knots += table[:, first : first + knots.shape[1]]

    def _scene(self, theta: Vector, times: Array) -> Scene:
        s, figures = self._sightings, self.figures
        observer, subject = np.zeros((len(times), 6)), np.zeros((len(times), 6))
        for name in dict.fromkeys(s.observers):
            rows = [i for i, o in enumerate(s.observers) if o == name]
            observer[rows] = self._pose(name, times[rows])
        for name in dict.fromkeys(s.subjects):
            rows = [i for i, o in enumerate(s.subjects) if o == name]
            subject[rows] = self._pose(name, times[rows])
        for column, part in enumerate(("x", "y", "z", "yaw", "roll", "pitch")):
            observer[:, column] += figures.of(theta, s.observers, part)
        mounting = [figures.of(theta, s.observers, part) for part in ("pan", "tilt", "ahead", "left", "up")]
        shares = [figures.of(theta, s.subjects, "print"), figures.of(theta, s.observers, "focal")]
        return Scene(observer, subject, np.column_stack(mounting), np.column_stack(shares))

    def _sighting_rows(self, rows: Rows, theta: Vector, forgiving: float) -> None:
        s, figures = self._sightings, self.figures
        times = s.times - figures.of(theta, s.observers, "delay")
        scene = self._scene(theta, times)
        here = predicted(self._looks, scene)
        after, before = (predicted(self._looks, self._scene(theta, times + step)) for step in (LATER_S, -LATER_S))
        rates = off(after, before) / (2.0 * LATER_S)
        gap = self._nearer(here)
        factor = np.linalg.inv(np.linalg.cholesky(noise(s.covariance, s.seen, rates, STAMP_STD_S)))
        squares = (np.einsum("nij,nj->ni", factor, gap) ** 2).sum(axis=1)
        weight = np.sqrt((_FREEDOM + 4.0) / (_FREEDOM + squares / forgiving**2))
        self._misfit = float(np.mean(np.minimum(squares, 50.0)) / 4.0)
        factor = factor * weight[:, None, None]
        at, _ = rows.add(np.einsum("nij,nj->ni", factor, gap).ravel(), 1.0)
        at = at.reshape(-1, 4)
        rows.beyond += float(np.sum((_FREEDOM + 4.0) * np.log1p(squares / _FREEDOM) - weight**2 * squares))
        by = {
            part: np.einsum("nij,njc->nic", factor, table) for part, table in slopes(self._looks, scene, here).items()
        }
        by["rates"] = np.einsum("nij,nj->ni", factor, -rates)[:, :, None]
        self._by_figures(rows, at, by)
        for names, part in ((s.observers, "observer"), (s.subjects, "subject")):
            self._by_knots(rows, at, by[part], names, times)

    def _nearer(self, here: Array) -> Array:
        """Return seen minus predicted, for the nearer pose where the detector gave two."""
        first, second = off(self._sightings.seen, here), off(self._sightings.other, here)
        nearer = np.linalg.norm(second, axis=1) < np.linalg.norm(first, axis=1)  # false for NaN
        return np.where(nearer[:, None], second, first)

    def _by_figures(self, rows: Rows, at: IntArray, by: Mapping[str, Array]) -> None:
        s, figures = self._sightings, self.figures
        for channel, part in enumerate(("x", "y", "z", "yaw", "roll", "pitch")):
            _figure(rows, at, figures.columns(s.observers, part), by["observer"][:, :, channel])
        for channel, part in enumerate(("pan", "tilt", "ahead", "left", "up")):
            _figure(rows, at, figures.columns(s.observers, part), by["mounting"][:, :, channel])
        _figure(rows, at, figures.columns(s.subjects, "print"), by["shares"][:, :, 0])
        _figure(rows, at, figures.columns(s.observers, "focal"), by["shares"][:, :, 1])
        _figure(rows, at, figures.columns(s.observers, "delay"), by["rates"][:, :, 0])

    def _by_knots(self, rows: Rows, at: IntArray, slopes_: Array, names: tuple[str, ...], times: Array) -> None:
        for name, first_column in self._first.items():
            mine = np.array([i for i, other in enumerate(names) if other == name], dtype=np.intp)
            if not len(mine):
                continue
            knot, share = self._path(name).grid.between(times[mine])
            if name in self.robots:
                self._by_bulge(rows, at[mine], slopes_[mine], name, times[mine])
                self._by_attitude(rows, at[mine], slopes_[mine], name, times[mine])
            channels = (0, 1, 2, 3, 4, 5) if name in self.robots else (0, 1, 3)
            for entry, channel in enumerate(channels):
                values = slopes_[mine, :, channel]
                for step, part in ((0, 1.0 - share), (1, share)):
                    columns = np.repeat(first_column + entry + self._stride * (knot + step), 4)
                    rows.by_knots(at[mine].ravel(), columns, (values * part[:, None]).ravel())

    def _by_attitude(self, rows: Rows, at: IntArray, slopes_: Array, name: str, times: Array) -> None:
        """Add the derivatives of an attitude by the common delay of all reports of its drone."""
        values = np.einsum("nic,nc->ni", slopes_[:, :, 3:], self.robots[name].turning(times))
        rows.by_figures(at.ravel(), np.full(at.size, self.figures.place[name, "own_delay"]), values.ravel())

    def _by_bulge(self, rows: Rows, at: IntArray, slopes_: Array, name: str, times: Array) -> None:
        """Add the derivatives of the curved way between knots by the heading."""
        path = self.robots[name]
        bulge = path.bulge(times)
        turned = np.column_stack((-bulge[:, 1], bulge[:, 0]))
        knot, _ = path.grid.between(times)
        values = 0.5 * np.einsum("nic,nc->ni", slopes_[:, :, :2], turned)
        for step in (0, 1):
            columns = np.repeat(self._first[name] + 3 + self._stride * (knot + step), 4)
            rows.by_knots(at.ravel(), columns, values.ravel())


def _figure(rows: Rows, at: IntArray, columns: IntArray, values: Array) -> None:
    rows.by_figures(at.ravel(), np.repeat(columns, 4), values.ravel())


def _pad(field: ResolvedField, name: str) -> tuple[Array, Array]:
    pad = stand_of(field).pads[name]
    pose = np.array([*pad.place_m, pad.height_m, pad.yaw_rad])
    return pose, np.array([PLACED_M, PLACED_M, pad.height_std_m, PLACED_RAD])

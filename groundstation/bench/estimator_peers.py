"""The filters of `bench estimator`: the product's kernels, filterpy's EKF, and dense numpy, behind one interface.

All use the same h, H, F and Q; only the filter around them differs.
"""

import math
from importlib.util import find_spec
from typing import Protocol

import numpy as np

from groundstation.arrays import Array, IntArray
from groundstation.bench.estimator_kernels import correct_frame, expect, predict_often
from groundstation.bench.estimator_team import SPEED_M_S, TURN_RAD_S, BenchTeam, belief_at
from groundstation.estimation.event_kernels import event_kernels
from groundstation.estimation.filter_state import State
from groundstation.estimation.models.constant_velocity import ConstantVelocityTarget
from groundstation.estimation.models.fixed_mount import FixedMount
from groundstation.estimation.models.odometry_robot import OdometryRobot
from groundstation.estimation.records import YAW, EventRow, OutcomeRow, Prediction
from groundstation.kernel import Rows

FILTERPY_MISSING = "filterpy is not installed: pip install 'skein-groundstation[peers]'"
_CLIMB_DENSITY, _TURN_SHARE = 1e-6, 0.02


class Contestant(Protocol):
    """A filter on a team's state."""

    @property
    def mean(self) -> Array:
        """Return the mean (n)."""

    @property
    def covariance(self) -> Array:
        """Return the covariance (n, n)."""

    def predict(self, dt: float, times: int) -> None:
        """Predict the whole team, several times over."""

    def correct(self, events: Rows[EventRow]) -> None:
        """Take all observations of a frame (edges), one after the other in most filters."""


class Ours:
    """The kernels of the product, called for many ticks or a whole frame at once."""

    def __init__(self, team: BenchTeam, state: State) -> None:
        self._tables, self._state, self._event_kernels = team.tables, state, event_kernels()
        self.outcomes = OutcomeRow.rows(len(team.edges))

    @property
    def mean(self) -> Array:
        """Return the mean (n)."""
        mean: Array = self._state.means[0, : self._tables.dim]
        return mean

    @property
    def covariance(self) -> Array:
        """Return the covariance (n, n)."""
        n = self._tables.dim
        covariance: Array = self._state.covariances[0, :n, :n]
        return covariance

    def predict(self, dt: float, times: int) -> None:
        """Predict the whole team, several times over."""
        predict_often(self._state, self._tables, dt, times)

    def correct(self, events: Rows[EventRow]) -> None:
        """Take all observations of a frame."""
        correct_frame(self._event_kernels, self._state, self._tables, events, self.outcomes)


class TeamModel:
    """F, Q and the moved mean of a team of minimal robots in numpy; h and its Jacobians from the product's kernel."""

    def __init__(self, team: BenchTeam) -> None:
        t = team.tables
        self.tables, self.dim = t, t.dim
        self._belief, self._expected = belief_at(t, team.truth), Prediction.rows(1)
        self.parts = [t.part(entity) for entity in range(len(t.priors))]
        self.x = np.array([t.part(team.index(name)).start for name in team.robots])
        self.yaws = np.append(self.x + YAW, t.part(team.index("ceiling")).start + YAW)
        self.target = t.part(team.index("target")).start
        self.rates = self._rates(team)

    def _rates(self, team: BenchTeam) -> Array:
        models, rates = team.parameters.entities, np.zeros(self.dim)
        for name in team.robots:
            start, robot = team.tables.part(team.index(name)).start, models[name]
            assert isinstance(robot, OdometryRobot)
            p = robot.own()
            rates[start : start + 4] = p["velocity_density"], p["velocity_density"], _CLIMB_DENSITY, p["yaw_density"]
        start, mount, target = team.tables.part(team.index("ceiling")).start, models["ceiling"], models["target"]
        assert isinstance(mount, FixedMount) and isinstance(target, ConstantVelocityTarget)
        rates[start : start + 6] = [mount.own()["position_drift"]] * 3 + [mount.own()["angle_drift"]] * 3
        self.acceleration = target.own()["acceleration_density"]
        return rates

    def move(self, mean: Array, dt: float) -> tuple[Array, Array, Array]:
        """Return f(x), F and Q over dt."""
        x, turn, target = self.x, TURN_RAD_S * dt, self.target
        heading = mean[x + YAW] + 0.5 * turn
        c, n = np.cos(heading) * dt, np.sin(heading) * dt
        dx, dy = SPEED_M_S * (c + 0.5 * n), SPEED_M_S * (n - 0.5 * c)
        F, Q, moved = np.eye(self.dim), np.diag(self.rates * dt), mean.copy()
        F[x, x + YAW], F[x + 1, x + YAW] = -dy, dx
        Q[x + YAW, x + YAW] += (_TURN_SHARE * turn) ** 2
        moved[x] += dx
        moved[x + 1] += dy
        moved[x + YAW] += turn
        for i in (target, target + 1):
            F[i, i + 2] = dt
            Q[i, i], Q[i + 2, i + 2] = self.acceleration * dt**3 / 3.0, self.acceleration * dt
            Q[i, i + 2] = Q[i + 2, i] = 0.5 * self.acceleration * dt**2
            moved[i] += dt * mean[i + 2]
        return self.wrapped(moved), F, Q

    def wrapped(self, mean: Array) -> Array:
        """Return the mean with its headings wrapped, in place."""
        mean[self.yaws] = (mean[self.yaws] + math.pi) % math.tau - math.pi
        return mean

    def measured(self, mean: Array, events: Rows[EventRow], row: int) -> tuple[Array, Array, Array, IntArray]:
        """Return y, R, H (rows, columns) and the state's columns of H."""
        event, out = events[row], self._expected[0]
        expect(self._belief._replace(mean=mean), self.tables.sensors, events, row, self._expected)
        rows, a, b = int(event["size"]), self.parts[event["observer"]], self.parts[event["subject"]]
        y = event["measured"]["z"][:rows] - out["h"][:rows]
        if rows == 4:
            y[3] = math.remainder(y[3], math.tau)
        R = event["measured"]["R"][:rows, :rows]
        both = np.hstack((out["H_observer"][:rows, : a.stop - a.start], out["H_subject"][:rows, : b.stop - b.start]))
        return y, R, both, np.r_[a, b]


class DenseNumpy:
    """The textbook in numpy with H restricted to the columns of an edge's two blocks, one edge after the other."""

    def __init__(self, team: BenchTeam, state: State) -> None:
        self.model, n = TeamModel(team), team.tables.dim
        self.mean, self.covariance = state.means[0, :n].copy(), state.covariances[0, :n, :n].copy()

    def predict(self, dt: float, times: int) -> None:
        """Predict the whole team, several times over."""
        for _ in range(times):
            self.mean, F, Q = self.model.move(self.mean, dt)
            self.covariance = F @ self.covariance @ F.T + Q

    def correct(self, events: Rows[EventRow]) -> None:
        """Take all observations of a frame, one after the other."""
        for row in range(len(events)):
            y, R, H, columns = self.model.measured(self.mean, events, row)
            PHt = self.covariance[:, columns] @ H.T
            S = H @ PHt[columns] + R
            K = np.linalg.solve(S, PHt.T).T
            self.mean = self.model.wrapped(self.mean + K @ y)
            self.covariance -= K @ PHt.T


class BatchNumpy(DenseNumpy):
    """Dense numpy that takes a frame at once in information form; all edges linearised at one point."""

    def correct(self, events: Rows[EventRow]) -> None:
        """Take all observations of a frame at once."""
        information, shift = np.linalg.inv(self.covariance), np.zeros(len(self.mean))
        for row in range(len(events)):
            y, R, H, columns = self.model.measured(self.mean, events, row)
            weighted = np.linalg.solve(R, H).T
            information[np.ix_(columns, columns)] += weighted @ H
            shift[columns] += weighted @ y
        self.covariance = np.linalg.inv(information)
        self.mean = self.model.wrapped(self.mean + self.covariance @ shift)


class Filterpy:
    """filterpy's ExtendedKalmanFilter, used as its documentation shows: one `update` per observation."""

    def __init__(self, team: BenchTeam, state: State) -> None:
        from filterpy.kalman import ExtendedKalmanFilter

        self.model = TeamModel(team)
        n = self.model.dim
        self.filter = ExtendedKalmanFilter(n, 4)
        self.filter.predict_x = self._move_to
        self.filter.x, self.filter.P = state.means[0, :n].copy(), state.covariances[0, :n, :n].copy()

    def _move_to(self, mean: Array) -> None:
        self.filter.x = mean

    @property
    def mean(self) -> Array:
        """Return the mean (n)."""
        return np.asarray(self.filter.x)

    @property
    def covariance(self) -> Array:
        """Return the covariance (n, n)."""
        return np.asarray(self.filter.P)

    def predict(self, dt: float, times: int) -> None:
        """Predict the whole team, several times over."""
        for _ in range(times):
            moved, self.filter.F, self.filter.Q = self.model.move(self.filter.x, dt)
            self.filter.predict(moved)

    def correct(self, events: Rows[EventRow]) -> None:
        """Take all observations of a frame, one after the other."""
        for row in range(len(events)):
            y, R, both, columns = self.model.measured(self.filter.x, events, row)
            H = np.zeros((len(y), self.model.dim))
            H[:, columns] = both
            self.filter.update(y, lambda x, H=H: H, lambda x: 0.0, R)
            self.filter.x = self.model.wrapped(self.filter.x)


def contestants(team: BenchTeam, state: State) -> dict[str, Contestant]:
    """Return all filters that are installed, on copies of one state."""
    found: dict[str, Contestant] = {"numpy": DenseNumpy(team, state), "numpy-batch": BatchNumpy(team, state)}
    if find_spec("filterpy") is not None:
        found["filterpy"] = Filterpy(team, state)
    return found


def difference(a: Contestant, b: Contestant) -> float:
    """Return the largest difference between two beliefs, over all entries of mean and covariance."""
    return float(max(np.abs(a.mean - b.mean).max(), np.abs(a.covariance - b.covariance).max()))

"""What `bench estimator` compares: the product's kernels, filterpy's EKF, and dense numpy, behind one interface.

All are given the same h, H, F and Q: what differs is the filter around them.
"""

import math
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.events import event_kernels
from groundstation.estimation.models.camera import measure_relative_pose
from groundstation.estimation.models.constant_velocity import ACCELERATION_DENSITY
from groundstation.estimation.models.fixed_mount import ANGLE_DRIFT, POSITION_DRIFT
from groundstation.estimation.models.odometry_robot import VELOCITY_DENSITY, YAW_DENSITY
from groundstation.estimation.tables import State
from groundstation.experiments.estimator_kernels import correct_frame, predict_often
from groundstation.experiments.estimator_team import SPEED_M_S, TURN_RAD_S, Team

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

    def correct(self, events: Array) -> None:
        """Take all observations of a frame (rows, EVENT_COLUMNS), one after the other unless it says otherwise."""


class Ours:
    """The kernels of the product, called for many ticks or a whole frame at once."""

    def __init__(self, team: Team, state: State) -> None:
        self._tables, self._state, self._event_kernels = team.tables, state, event_kernels()
        self.outcomes = np.zeros((len(team.edges), s.OUT_COLUMNS))

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
        t, state = self._tables, self._state
        predict_often(state.means[0], state.covariances[0], t.entities[0], t.parameters[0], state.aux, dt, times)

    def correct(self, events: Array) -> None:
        """Take all observations of a frame."""
        t, state = self._tables, self._state
        correct_frame(
            self._event_kernels,
            state.means,
            state.covariances,
            state.weights,
            state.aux,
            t.entities,
            t.parameters,
            t.priors,
            t.kernels,
            t.sensors,
            state.pairs,
            t.settings,
            events,
            self.outcomes,
        )


class TeamModel:
    """F, Q and the moved mean of a team of minimal robots in numpy; h and its Jacobians from the product's kernel."""

    def __init__(self, team: Team) -> None:
        t = team.tables
        self.tables, self.dim = t, t.dim
        self.x = np.array([t.part(team.index(name)).start for name in team.robots])
        self.yaws = np.append(self.x + s.YAW, t.part(team.index("ceiling")).start + s.YAW)
        self.target = t.part(team.index("target")).start
        self.rates = self._rates(team)

    def _rates(self, team: Team) -> Array:
        rows, rates = team.tables.parameters[0], np.zeros(self.dim)
        for name in team.robots:
            start, p = team.tables.part(team.index(name)).start, rows[team.index(name)]
            rates[start : start + 4] = p[VELOCITY_DENSITY], p[VELOCITY_DENSITY], _CLIMB_DENSITY, p[YAW_DENSITY]
        start, p = team.tables.part(team.index("ceiling")).start, rows[team.index("ceiling")]
        rates[start : start + 6] = [p[POSITION_DRIFT]] * 3 + [p[ANGLE_DRIFT]] * 3
        self.acceleration = rows[team.index("target"), ACCELERATION_DENSITY]
        return rates

    def move(self, mean: Array, dt: float) -> tuple[Array, Array, Array]:
        """Return f(x), F and Q over dt."""
        x, turn, target = self.x, TURN_RAD_S * dt, self.target
        heading = mean[x + s.YAW] + 0.5 * turn
        c, n = np.cos(heading) * dt, np.sin(heading) * dt
        dx, dy = SPEED_M_S * (c + 0.5 * n), SPEED_M_S * (n - 0.5 * c)
        F, Q, moved = np.eye(self.dim), np.diag(self.rates * dt), mean.copy()
        F[x, x + s.YAW], F[x + 1, x + s.YAW] = -dy, dx
        Q[x + s.YAW, x + s.YAW] += (_TURN_SHARE * turn) ** 2
        moved[x] += dx
        moved[x + 1] += dy
        moved[x + s.YAW] += turn
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

    def measured(self, mean: Array, event: Array) -> tuple[Array, Array, Array, IntArray]:
        """Return y, R, H (rows, columns) and the columns of the state that H stands for."""
        t, observer, subject = self.tables, int(event[s.EVENT_OBSERVER]), int(event[s.EVENT_SUBJECT])
        rows, sensor = int(event[s.EVENT_SIZE]), t.sensors[int(event[s.EVENT_SENSOR])]
        h, H = np.zeros(4), np.zeros((2, 4, s.MAX_BLOCK))
        measure_relative_pose(mean, t.entities[0], t.parameters[0], sensor, event, rows, h, H[0], H[1])
        a, b = t.part(observer), t.part(subject)
        y = event[s.EVENT_Z : s.EVENT_Z + rows] - h[:rows]
        if rows == 4:
            y[3] = math.remainder(y[3], math.tau)
        R = event[s.EVENT_Z + 4 : s.EVENT_Z + 20].reshape(4, 4)[:rows, :rows]
        both = np.hstack((H[0, :rows, : a.stop - a.start], H[1, :rows, : b.stop - b.start]))
        return y, R, both, np.r_[a, b]


class DenseNumpy:
    """The textbook in numpy with H restricted to the columns of an edge's two blocks, one edge after the other."""

    def __init__(self, team: Team, state: State) -> None:
        self.model, n = TeamModel(team), team.tables.dim
        self.mean, self.covariance = state.means[0, :n].copy(), state.covariances[0, :n, :n].copy()

    def predict(self, dt: float, times: int) -> None:
        """Predict the whole team, several times over."""
        for _ in range(times):
            self.mean, F, Q = self.model.move(self.mean, dt)
            self.covariance = F @ self.covariance @ F.T + Q

    def correct(self, events: Array) -> None:
        """Take all observations of a frame, one after the other."""
        for event in events:
            y, R, H, columns = self.model.measured(self.mean, event)
            PHt = self.covariance[:, columns] @ H.T
            S = H @ PHt[columns] + R
            K = np.linalg.solve(S, PHt.T).T
            self.mean = self.model.wrapped(self.mean + K @ y)
            self.covariance -= K @ PHt.T


class BatchNumpy(DenseNumpy):
    """Dense numpy that takes a frame at once in information form; all edges linearised at one point."""

    def correct(self, events: Array) -> None:
        """Take all observations of a frame at once."""
        information, shift = np.linalg.inv(self.covariance), np.zeros(len(self.mean))
        for event in events:
            y, R, H, columns = self.model.measured(self.mean, event)
            weighted = np.linalg.solve(R, H).T
            information[np.ix_(columns, columns)] += weighted @ H
            shift[columns] += weighted @ y
        self.covariance = np.linalg.inv(information)
        self.mean = self.model.wrapped(self.mean + self.covariance @ shift)


class Filterpy:
    """filterpy's ExtendedKalmanFilter, used as its documentation shows: one `update` per observation."""

    def __init__(self, team: Team, state: State) -> None:
        from filterpy.kalman import ExtendedKalmanFilter

        class Moved(ExtendedKalmanFilter):  # type: ignore[misc]
            def predict_x(self, u: Any = 0) -> None:
                self.x = u

        self.model = TeamModel(team)
        n = self.model.dim
        self.filter = Moved(n, 4)
        self.filter.x, self.filter.P = state.means[0, :n].copy(), state.covariances[0, :n, :n].copy()

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

    def correct(self, events: Array) -> None:
        """Take all observations of a frame, one after the other."""
        for event in events:
            y, R, both, columns = self.model.measured(self.filter.x, event)
            H = np.zeros((len(y), self.model.dim))
            H[:, columns] = both
            self.filter.update(y, lambda x, H=H: H, lambda x: 0.0, R)
            self.filter.x = self.model.wrapped(self.filter.x)


def contestants(team: Team, state: State) -> dict[str, Contestant]:
    """Return all filters that are installed, on copies of one state."""
    found: dict[str, Contestant] = {"numpy": DenseNumpy(team, state), "numpy-batch": BatchNumpy(team, state)}
    if find_spec("filterpy") is not None:
        found["filterpy"] = Filterpy(team, state)
    return found


def difference(a: Contestant, b: Contestant) -> float:
    """Return the largest difference between two beliefs, over all entries of mean and covariance."""
    return float(max(np.abs(a.mean - b.mean).max(), np.abs(a.covariance - b.covariance).max()))

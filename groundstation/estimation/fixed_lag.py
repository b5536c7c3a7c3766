"""The joint filter with an exact, bounded rewind: measurements in any order of arrival, belief as if in order.

Time is divided into steps. Odometry is condensed per step, events (observations, take-offs, landings) keep their exact
time. Whatever arrives makes its step dirty; `advance` restarts from the checkpoint of the oldest dirty step.
"""

import math

import numpy as np

from groundstation.bus.messages import Verdict
from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, JointBelief
from groundstation.estimation.correction import is_distribution
from groundstation.estimation.event_log import EventLog, observation_columns
from groundstation.estimation.gating import gate
from groundstation.estimation.layout import EntityKind, Layout
from groundstation.estimation.measurement import Correction, Measurement, Motion
from groundstation.estimation.models import FixedMount, OdometryRobot
from groundstation.estimation.parameters import EstimatorParameters
from groundstation.estimation.replay import replay

NS_PER_S = 1_000_000_000
_FUTURE_NS = 100_000_000  # a measurement further ahead of now than this is an error of a clock
_IDLE_STEPS = 10  # steps that may pass between two calls of `advance` before `add_*` advances by itself


class FixedLagFilter:
    """Joint EKF over all entities of the parameters that have joined.

    `add_motion`, `add_observation`, `set_airborne` take what arrives in any order (up to max_lateness_s late) and
    answer with a verdict; `advance` brings the belief to a time; `take_corrections` says what the observations did.
    """

    def __init__(self, parameters: EstimatorParameters) -> None:
        self.parameters = parameters
        self.names = tuple(parameters.entities)
        self._corrections: list[Correction] = []
        self._models = tuple(parameters.entities.values())
        self._index = {name: i for i, name in enumerate(self.names)}
        self._step_ns = round(parameters.step_s * NS_PER_S)
        self._lag_ns = round(parameters.max_lateness_s * NS_PER_S)
        self._delays = {
            i: (round(model.velocity_delay_s * NS_PER_S), round(model.height_delay_s * NS_PER_S))
            for i, model in enumerate(self._models)
            if isinstance(model, OdometryRobot)
        }
        slowest = max((max(pair) for pair in self._delays.values()), default=0)
        self._ahead = _FUTURE_NS // self._step_ns + 2 + _IDLE_STEPS  # steps after now that a measurement may fall into
        self._behind = (self._lag_ns + slowest) // self._step_ns + 3
        self._build_tables()
        self._build_state(self._behind + self._ahead)

    def add_motion(self, robot: str, motion: Motion, now_ns: int) -> Verdict:
        """Take one odometry sample; its velocity and height were true one calibrated delay before its stamp."""
        index = self._index.get(robot)
        if index is None or index not in self._delays:
            return Verdict.UNKNOWN_ENTITY
        verdict = self._timing(motion.stamp_ns, now_ns)
        if verdict is not Verdict.ACCEPTED:
            return verdict
        velocity_delay, height_delay = self._delays[index]
        vx, vy, vz = motion.velocity_m_s
        row = self._touch(motion.stamp_ns - velocity_delay, index)
        row[s.SUM_VX] += vx
        row[s.SUM_VY] += vy
        row[s.SUM_VZ] += vz
        row[s.VELOCITY_COUNT] += 1.0
        row = self._touch(motion.stamp_ns, index)
        at = float(motion.stamp_ns - self._origin_ns)
        if at >= row[s.NEWEST_AT]:
            row[s.NEWEST_YAW], row[s.NEWEST_RESET], row[s.NEWEST_AT] = motion.yaw_rad, motion.reset, at
        if motion.height_m is not None:
            row = self._touch(motion.stamp_ns - height_delay, index)
            row[s.HEIGHT_SUM] += motion.height_m
            row[s.HEIGHT_COUNT] += 1.0
        return verdict

    def add_observation(self, m: Measurement, tie: str, now_ns: int) -> Verdict | None:
        """Take one observation; None: `take_corrections` tells what it did after `advance`, else why it was refused.

        tie: orders observations of the same instant, so that their arrival cannot.
        """
        camera, subject = self._camera_index.get(m.camera), self._index.get(m.subject)
        if camera is None or subject is None or self._mounts[camera].carrier == m.subject:
            return Verdict.UNKNOWN_ENTITY
        mount = self._mounts[camera]
        if not mount.observes_targets and self._models[subject].kind is EntityKind.TARGET:
            return Verdict.NOT_PERMITTED
        verdict = self._timing(m.stamp_ns, now_ns)
        if verdict is not Verdict.ACCEPTED:
            return verdict
        step = self._mark(m.stamp_ns)
        observer = self._index[mount.carrier]
        columns = observation_columns(m, self._seconds(m.stamp_ns), step, observer, subject, camera)
        row = self._log.add(m.stamp_ns, tie, columns)
        self._fresh[row] = (mount.carrier, m.subject, (now_ns - m.stamp_ns) / 1e6)
        return None

    def set_airborne(self, robot: str, airborne: bool, stamp_ns: int, now_ns: int) -> Verdict:
        """Take a change of flight state: only airborne robots join the state, a landed one leaves it.

        Later than the rewind reaches, it takes effect as early as it can.
        """
        index = self._index.get(robot)
        if index is None or self._models[index].kind is not EntityKind.ROBOT:
            return Verdict.UNKNOWN_ENTITY
        if self._timing(stamp_ns, now_ns) is not Verdict.ACCEPTED:
            stamp_ns = now_ns
        step = self._mark(stamp_ns)
        kind = s.KIND_AIRBORNE if airborne else s.KIND_GROUNDED
        columns = [self._seconds(stamp_ns), kind, 0.0, index, 0.0, 0.0, 0.0, 0.0, step]
        self._log.add(stamp_ns, f"@{robot}/{airborne:d}", columns)
        return Verdict.ACCEPTED

    def advance(self, now_ns: int) -> None:
        """Bring the belief to `now_ns`, through everything that has arrived; time never runs backwards."""
        self._start(now_ns)
        now_ns = max(now_ns, self._now_ns)
        while self._step_of(now_ns) - self._last > self._ahead - 1:  # the rings hold only so much at once
            self._replay_to(self._origin_ns + (self._last + self._ahead - 1) * self._step_ns)
        self._replay_to(now_ns)
        self._report()

    def take_corrections(self) -> list[Correction]:
        """Return and forget what became of the observations that were reached since the last call."""
        corrections, self._corrections = self._corrections, []
        return corrections

    @property
    def stamp_ns(self) -> int:
        """Return the time that the belief is valid at."""
        return self._now_ns

    def is_sound(self) -> bool:
        """Return whether the belief is still a distribution: finite, and its covariance positive definite."""
        return bool(is_distribution(self._mean, self._P, self._entities, self._aux))

    def restart(self) -> None:
        """Forget the belief and everything that arrived; who flies is kept, who is where must be seen again."""
        airborne = self._aux[:, s.AIRBORNE].copy()
        now_ns = self._now_ns
        self._build_state(self._behind + self._ahead)
        self._auxiliaries[:, :, s.AIRBORNE] = airborne
        self._aux[:, s.AIRBORNE] = airborne
        self._start(now_ns)

    def belief(self) -> JointBelief:
        """Return the belief over the entities that have joined."""
        layout = Layout()
        kept: list[int] = []
        for name, model, entity, aux in zip(self.names, self._models, self._entities, self._aux, strict=True):
            if aux[s.ACTIVE]:
                layout = layout.with_entity(name, model.kind, model.labels)
                kept.extend(range(entity[s.ENTITY_START], entity[s.ENTITY_START] + entity[s.ENTITY_SIZE]))
        return JointBelief(self._mean[kept], self._P[np.ix_(kept, kept)], layout, self._now_ns)

    def age_s(self, name: str) -> float:
        """Return the time since an entity was last corrected by an observation; infinite if it has not joined."""
        aux = self._aux[self._index[name]]
        return self._seconds(self._now_ns) - float(aux[s.CORRECTED_AT]) if aux[s.ACTIVE] else math.inf

    def airborne(self, robot: str) -> bool:
        """Return whether a robot flies, as far as is known."""
        return bool(self._aux[self._index[robot], s.AIRBORNE])

    def velocity_of(self, robot: str) -> tuple[float, float, float]:
        """Return a joined robot's velocity [m/s; world] from its last odometry and its scale state."""
        index = self._index[robot]
        start, aux = int(self._entities[index, s.ENTITY_START]), self._aux[index]
        gain = self._rows[index, s.VELOCITY_GAIN] * self._mean[start + s.SCALE]
        c, n = math.cos(self._mean[start + s.YAW]) * gain, math.sin(self._mean[start + s.YAW]) * gain
        vx, vy = aux[s.HELD_VX], aux[s.HELD_VY]
        climb = self._mean[start + s.CLIMB] + self._rows[index, s.HAS_CLIMB_RATE] * aux[s.HELD_VZ]
        return float(c * vx - n * vy), float(n * vx + c * vy), float(climb)

    def _build_tables(self) -> None:
        models, parameters = self._models, self.parameters
        sizes = [len(model.labels) for model in models]
        table = [[m.number, sum(sizes[:i]), sizes[i]] for i, m in enumerate(models)]
        self._entities = np.array(table, dtype=np.int64).reshape(-1, s.ENTITY_COLUMNS)
        self._rows = np.array([m.row() for m in models]).reshape(-1, s.PARAMETER_COLUMNS)
        self._mounts = tuple(parameters.cameras.values())
        self._camera_index = {name: i for i, name in enumerate(parameters.cameras)}
        self._camera_rows = np.array([c.row() for c in self._mounts]).reshape(-1, s.CAMERA_COLUMNS)
        gates = [gate(parameters.gate_probability, rows) for rows in range(1, 5)]
        scalars = (parameters.step_s, parameters.wild_gates, parameters.divergence_count, parameters.divergence_s)
        self._settings = np.array([*map(float, scalars), 0.0, *gates, 0.0])

    def _build_state(self, ring: int) -> None:
        n, entities = int(self._entities[:, s.ENTITY_SIZE].sum()), len(self.names)
        self._means, self._covariances = np.zeros((ring, n)), np.zeros((ring, n, n))
        self._auxiliaries = np.zeros((ring, entities, s.AUXILIARY_COLUMNS))
        self._odometry = np.zeros((ring, entities, s.ODOMETRY_COLUMNS))
        self._odometry[:, :, s.NEWEST_AT] = -1.0
        self._log = EventLog()
        self._fresh: dict[int, tuple[str, str, float]] = {}
        self._mean, self._P = np.zeros(n), np.zeros((n, n))
        self._aux = np.zeros((entities, s.AUXILIARY_COLUMNS))
        for model, entity, aux in zip(self._models, self._entities, self._auxiliaries[0], strict=True):
            if isinstance(model, FixedMount):
                part = slice(entity[s.ENTITY_START], entity[s.ENTITY_START] + entity[s.ENTITY_SIZE])
                self._means[0, part], variances = model.prior()
                self._covariances[0, part, part] = np.diag(variances)
                aux[s.ACTIVE] = 1.0
        self._started = False
        self._origin_ns = self._now_ns = self._last = self._dirty = 0

    def _start(self, now_ns: int) -> None:
        if not self._started:
            self._started = True
            # On a grid that does not depend on what came first: step borders are multiples of the step.
            self._origin_ns = (now_ns // self._step_ns - self._behind) * self._step_ns
            self._now_ns, self._last, self._dirty = now_ns, self._behind, 0

    def _timing(self, stamp_ns: int, now_ns: int) -> Verdict:
        self._start(now_ns)
        if self._step_of(now_ns) > self._last + _IDLE_STEPS:
            self.advance(now_ns)
        now_ns = max(now_ns, self._now_ns)
        if stamp_ns < now_ns - self._lag_ns:
            return Verdict.LATE
        return Verdict.IMPLAUSIBLE if stamp_ns > now_ns + _FUTURE_NS else Verdict.ACCEPTED

    def _step_of(self, stamp_ns: int) -> int:
        return (stamp_ns - self._origin_ns) // self._step_ns

    def _seconds(self, stamp_ns: int) -> float:
        return (stamp_ns - self._origin_ns) / NS_PER_S

    def _mark(self, stamp_ns: int) -> int:
        step = self._step_of(stamp_ns)
        self._dirty = min(self._dirty, step)
        return step

    def _touch(self, stamp_ns: int, robot: int) -> Array:
        row: Array = self._odometry[self._mark(stamp_ns) % len(self._odometry), robot]
        return row

    def _replay_to(self, now_ns: int) -> None:
        last = self._step_of(now_ns)
        ring = len(self._means)
        for step in range(self._last + self._ahead + 1, last + self._ahead + 1):
            self._odometry[step % ring] = 0.0
            self._odometry[step % ring, :, s.NEWEST_AT] = -1.0
        first = min(self._dirty, self._last)
        replay(
            self._entities,
            self._rows,
            self._camera_rows,
            self._settings,
            self._means,
            self._covariances,
            self._auxiliaries,
            self._odometry,
            self._log.events,
            self._log.rows_from(self._origin_ns + first * self._step_ns),
            self._log.outcomes,
            first,
            last,
            self._seconds(now_ns),
            self._mean,
            self._P,
            self._aux,
        )
        self._now_ns, self._last, self._dirty = now_ns, last, last
        self._log.forget_before(self._origin_ns + (last - self._behind) * self._step_ns)

    def _report(self) -> None:
        for row in [row for row in self._fresh if self._log.verdict_code(row) != s.PENDING]:
            self._corrections.append(self._log.correction(row, *self._fresh.pop(row)))

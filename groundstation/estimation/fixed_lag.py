"""The joint filter with an exact, bounded rewind: measurements may arrive in any order, as if they were in order.

Time is divided into steps. Odometry is condensed per step, events (observations, take-offs, landings) keep their exact
time. Each arrival marks its step dirty; `advance` restarts from the checkpoint of the oldest dirty step.
"""

import math
from collections.abc import Sequence

import numpy as np

from groundstation.arrays import IntArray
from groundstation.bus.messages import Vector3, Verdict
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.correction import is_distribution
from groundstation.estimation.event_kernels import event_kernels
from groundstation.estimation.event_log import EventLog, change_values, observation_values
from groundstation.estimation.filter_state import Belief, Inputs, Span
from groundstation.estimation.layout import EntityKind, StateLayout
from groundstation.estimation.measurement import Correction, Measurement, OdometrySample, SensorReading
from groundstation.estimation.models.protocol import DrivenModel
from groundstation.estimation.modes import moments_of
from groundstation.estimation.odometry_ring import OdometryRing
from groundstation.estimation.parameters import EstimatorParameters
from groundstation.estimation.records import ADMITTED, COMPARED, DISMISSED, OBSERVATION, PLACED, REPORTED, EntityMemory
from groundstation.estimation.replay import replay
from groundstation.estimation.tables import checkpoints_of, empty_state, tables_from_parameters
from groundstation.time_units import NS_PER_MS, NS_PER_S

_FORGOTTEN_NS = 60 * NS_PER_S  # after such a pause (a suspended host) no belief is worth predicting
FUTURE_NS = 100 * NS_PER_MS  # a measurement further ahead of now than this is an error of a clock
_Presence = tuple[list[int], list[float], list[int]]
_IDLE_STEPS = 10  # steps that may pass between two calls of `advance` before `add_*` advances by itself


class FixedLagFilter:
    """Joint EKF over all entities of the parameters that have joined.

    `add_motion`, `add_observation`, `set_airborne` take arrivals in any order (up to max_lateness_s late) and return a
    verdict; `advance` brings the belief to a time; `take_corrections` returns the effects of observations.
    """

    def __init__(self, parameters: EstimatorParameters) -> None:
        self.parameters = parameters
        self.names = tuple(parameters.entities)
        self._corrections: list[Correction] = []
        self._models = tuple(parameters.entities.values())
        self._index = {name: i for i, name in enumerate(self.names)}
        self._sensors = tuple(parameters.sensors.values())
        self._sensor_index = {name: i for i, name in enumerate(parameters.sensors)}
        self._tables, self._event_kernels = tables_from_parameters(parameters), event_kernels()
        self._now_ns: int
        self._present: _Presence | None
        self._last: int
        self._step_ns = round(parameters.step_s * NS_PER_S)
        self._lag_ns = round(parameters.max_lateness_s * NS_PER_S)
        self._layouts: dict[bytes, tuple[StateLayout, tuple[IntArray, ...]]] = {}
        self._driven = {i: model for i, model in enumerate(self._models) if isinstance(model, DrivenModel)}
        self._delays = {
            i: (round(model.velocity_delay_s * NS_PER_S), round(model.height_delay_s * NS_PER_S))
            for i, model in self._driven.items()
        }
        delays = [delay for pair in self._delays.values() for delay in pair]
        # Steps after and before now that a measurement may fall into; a command is followed after its stamp.
        self._ahead = (FUTURE_NS + max(0, *(-d for d in delays), 0)) // self._step_ns + 2 + _IDLE_STEPS
        self._behind = (self._lag_ns + max(0, *delays, 0)) // self._step_ns + 3
        # Number of steps, with the present one, whose observations wait: all before them ended at least `wait_s` ago.
        self._wait_steps = math.ceil(parameters.wait_s / parameters.step_s) + 1 if parameters.wait_s > 0.0 else 0
        self._build_state([model.admitted for model in self._models])

    def add_motion(self, robot: str, motion: OdometrySample, now_ns: int) -> Verdict:
        """Take one odometry sample; its velocity and height were true one calibrated delay before its stamp."""
        index = self._index.get(robot)
        if index is None or index not in self._delays:
            return Verdict.UNKNOWN_ENTITY
        verdict = self._timing(motion.stamp_ns, now_ns)
        if verdict is not Verdict.ACCEPTED:
            return verdict
        velocity_delay, height_delay = self._delays[index]
        self._odometry.add_velocity(self._mark(motion.stamp_ns - velocity_delay), index, motion)
        step = self._mark(motion.stamp_ns)
        self._odometry.add_attitude(step, index, motion, motion.stamp_ns - self._origin_ns)
        if motion.height_m is not None:
            self._odometry.add_height(self._mark(motion.stamp_ns - height_delay), index, motion.height_m)
        return verdict

    def add_report(self, reading: SensorReading, tie: str, now_ns: int, *, used: bool) -> Verdict | None:
        """Take an entity's report of its own motion, to be used or only compared; returns as `add_observation` does.

        A report is no sighting: no entity joins by it, it is refused beyond the gate, and corrects no other entity.
        """
        return self._add(reading, REPORTED if used else COMPARED, tie, now_ns)

    def add_observation(self, m: Measurement | SensorReading, tie: str, now_ns: int) -> Verdict | None:
        """Take one observation; None: `take_corrections` has its effect after `advance`, else why it was refused.

        tie: orders observations of the same instant, so that their order of arrival does not matter.
        """
        return self._add(m, OBSERVATION, tie, now_ns)

    def _add(self, m: Measurement | SensorReading, kind: int, tie: str, now_ns: int) -> Verdict | None:
        name = m.camera if isinstance(m, Measurement) else m.sensor
        number, subject = self._sensor_index.get(name), self._index.get(m.subject)
        if number is None or subject is None:
            return Verdict.UNKNOWN_ENTITY
        sensor = self._sensors[number]
        if isinstance(m, Measurement) and sensor.carrier == m.subject:
            return Verdict.UNKNOWN_ENTITY
        if not sensor.observes_targets and self._models[subject].kind is EntityKind.TARGET:
            return Verdict.NOT_PERMITTED
        verdict = self._timing(m.stamp_ns, now_ns)
        if verdict is not Verdict.ACCEPTED:
            return verdict
        step = self._mark(m.stamp_ns)
        observer = self._index[sensor.carrier]
        values = observation_values(m, self._seconds(m.stamp_ns), step, observer, subject, number, kind)
        row = self._log.add(m.stamp_ns, tie, values)
        self._fresh[row] = (sensor.carrier, m.subject, (now_ns - m.stamp_ns) / 1e6)
        return None

    def set_airborne(self, robot: str, airborne: bool, stamp_ns: int, now_ns: int) -> Verdict:
        """Take a change of flight state: only airborne robots join the state, a landed one leaves it.

        A change older than the rewind reaches takes effect as early as possible.
        """
        index = self._index.get(robot)
        if index is None or self._models[index].kind is not EntityKind.ROBOT:
            return Verdict.UNKNOWN_ENTITY
        return self.set_present(robot, airborne, stamp_ns, now_ns)

    def set_present(self, name: str, present: bool, stamp_ns: int, now_ns: int) -> Verdict:
        """Let an entity join, or take it out of the state; an entity with a prior (a fixed camera) joins at once.

        Robots and targets join with the next observation that can place them. A leaving entity loses its correlations.
        """
        kind = ADMITTED if present else DISMISSED
        return self._change(name, kind, (), f"{present:d}", stamp_ns, now_ns)

    def place(
        self, name: str, pose: Sequence[float], variances: Sequence[float], stamp_ns: int, now_ns: int
    ) -> Verdict:
        """Put an entity at a pose (x, y, z, yaw) [m, rad; world] with these variances, independent of all others.

        Raises ValueError unless all are finite and the variances positive.
        """
        placed = [*map(float, pose), *np.diag(np.asarray(variances, dtype=np.float64)).ravel().tolist()]
        if len(placed) != 20 or not np.isfinite(placed).all() or min(variances) <= 0.0:
            raise ValueError("a pose has 4 finite numbers and 4 positive variances")
        return self._change(name, PLACED, placed, "placed", stamp_ns, now_ns)

    def advance(self, now_ns: int) -> None:
        """Bring the belief to `now_ns`, through all arrivals; time never runs backwards."""
        self._start(now_ns)
        now_ns = max(now_ns, self._now_ns)
        if now_ns - self._now_ns > _FORGOTTEN_NS:
            self._now_ns = now_ns
            self.restart()
        while self._step_of(now_ns) - self._last > self._ahead - 1:  # the rings hold only so much at once
            self._replay_to(self._origin_ns + (self._last + self._ahead - 1) * self._step_ns)
        self._replay_to(now_ns)
        self._report()

    def take_corrections(self) -> list[Correction]:
        """Return and clear the corrections made since the last call."""
        corrections, self._corrections = self._corrections, []
        return corrections

    @property
    def stamp_ns(self) -> int:
        """Return the time that the belief is valid at."""
        return self._now_ns

    def is_sound(self) -> bool:
        """Return whether the belief is still a distribution: finite, and its covariance positive definite."""
        return bool(is_distribution(Belief(*self._moments, self._tables.entities[0], self._state.memory)))

    def restart(self) -> None:
        """Clear the belief and all inputs; permissions to join are kept."""
        now_ns = self._now_ns
        self._build_state(self._state.memory["admitted"].tolist())
        self._start(now_ns)

    def belief(self) -> JointBelief:
        """Return the belief over the entities that have joined."""
        joined = self._state.memory["active"].tobytes()
        if joined not in self._layouts:
            self._layouts[joined] = self._layout()
        layout, kept = self._layouts[joined]
        return JointBelief(self._moments.mean[kept[1][0]], self._moments.P[kept], layout, self._now_ns)

    def age_s(self, name: str) -> float:
        """Return the time since an entity was last corrected by an observation; infinite if it has not joined."""
        active, corrected_at, _ = self._presence
        index = self._index[name]
        return self._seconds(self._now_ns) - corrected_at[index] if active[index] else math.inf

    def sighting(self, name: str) -> tuple[float, float] | None:
        """Return the time since an entity was last seen [s], and the deviation of its place then [m]; None: never."""
        memory = self._state.memory[self._index[name]]
        seen = memory["active"] and memory["seen_variance"] > 0.0
        return (self.age_s(name), math.sqrt(float(memory["seen_variance"]))) if seen else None

    def contradicted(self, name: str) -> bool:
        """Return whether sightings far from an entity's place are being weighed against it."""
        # At most for twice the time that it takes: later ones beyond the gate are ignored; one within the gate ends it.
        memory, within_s = self._state.memory[self._index[name]], self.parameters.divergence_s
        now, wild = self._seconds(self._now_ns), memory["wild"]
        if memory["corrected_at"] > wild["last"]:
            return False
        lately = now - float(wild["last"]) <= within_s and now - float(wild["since"]) <= 2.0 * within_s
        return bool(wild["count"] >= 2 and lately)

    def airborne(self, robot: str) -> bool:
        """Return whether a robot flies, as far as is known."""
        return bool(self._presence[2][self._index[robot]])

    def velocity_of(self, robot: str) -> tuple[float, float, float]:
        """Return a joined robot's velocity [m/s; world] from its last odometry, corrected by its estimated errors."""
        if robot not in self._velocities:
            (model, memory), own = self.driven(robot), self._moments.mean[self._tables.part(self._index[robot])]
            self._velocities[robot] = model.velocity_m_s(own, memory)
        return self._velocities[robot]

    def driven(self, robot: str) -> tuple[DrivenModel, EntityMemory]:
        """Return a joined robot's model, and what it holds of its inputs."""
        return self._driven[self._index[robot]], self._state.memory[self._index[robot]]

    def mode_probabilities(self) -> tuple[float, ...]:
        """Return how likely each combination of modes is; one number where no target switches."""
        return tuple(self._state.weights.tolist())

    @property
    def _presence(self) -> _Presence:
        """Return for each entity whether it is in the state, when it was last corrected, and whether it may join."""
        if self._present is None:
            memory = self._state.memory
            self._present = memory["active"].tolist(), memory["corrected_at"].tolist(), memory["admitted"].tolist()
        return self._present

    def _layout(self) -> tuple[StateLayout, tuple[IntArray, ...]]:
        """Return the layout over the entities that have joined, and its entries as indices of rows and columns."""
        layout, kept = StateLayout(), list[int]()
        active = self._state.memory["active"]
        for index, (name, model) in enumerate(zip(self.names, self._models, strict=True)):
            if active[index] and model.labels:
                layout = layout.with_entity(name, model.kind, model.labels)
                part = self._tables.part(index)
                kept.extend(range(part.start, part.stop))
        return layout, np.ix_(kept, kept)

    def _build_state(self, admitted: Sequence[bool]) -> None:
        ring = self._behind + self._ahead
        self._state = empty_state(self._tables, admitted)
        self._checkpoints = checkpoints_of(self._state, ring)
        self._odometry = OdometryRing(ring, len(self.names))
        self._log = EventLog()
        self._fresh: dict[int, tuple[str, str, float]] = {}
        self._moments = moments_of(self._state)
        self._velocities: dict[str, Vector3] = {}
        self._present, self._started = None, False
        self._origin_ns = self._now_ns = self._last = self._dirty = 0

    def _change(self, name: str, kind: int, placed: Sequence[float], tie: str, stamp_ns: int, now_ns: int) -> Verdict:
        index = self._index.get(name)
        if index is None:
            return Verdict.UNKNOWN_ENTITY
        if self._timing(stamp_ns, now_ns) is not Verdict.ACCEPTED:
            stamp_ns = now_ns
        step = self._mark(stamp_ns)
        values = change_values(kind, self._seconds(stamp_ns), step, index, placed)
        self._log.add(stamp_ns, f"@{name}/{tie}", values)
        return Verdict.ACCEPTED

    def _start(self, now_ns: int) -> None:
        if self._started:
            return
        self._started = True
        # On a grid that does not depend on the first arrival: step borders are multiples of the step.
        self._origin_ns = (now_ns // self._step_ns - self._behind) * self._step_ns
        self._now_ns, self._last, self._dirty = now_ns, self._behind, 0

    def _timing(self, stamp_ns: int, now_ns: int) -> Verdict:
        self._start(now_ns)
        if self._step_of(now_ns) > self._last + _IDLE_STEPS:
            self.advance(now_ns)
        now_ns = max(now_ns, self._now_ns)
        if stamp_ns < now_ns - self._lag_ns:
            return Verdict.LATE
        return Verdict.IMPLAUSIBLE if stamp_ns > now_ns + FUTURE_NS else Verdict.ACCEPTED

    def _step_of(self, stamp_ns: int) -> int:
        return (stamp_ns - self._origin_ns) // self._step_ns

    def _seconds(self, stamp_ns: int) -> float:
        return (stamp_ns - self._origin_ns) / NS_PER_S

    def _mark(self, stamp_ns: int) -> int:
        step = (stamp_ns - self._origin_ns) // self._step_ns
        if step < self._dirty:
            self._dirty = step
        return step

    def _replay_to(self, now_ns: int) -> None:
        last = self._step_of(now_ns)
        for step in range(self._last + self._ahead + 1, last + self._ahead + 1):
            self._odometry.clear(step)
        first, log = self._dirty, self._log
        order = log.rows_from(self._origin_ns + first * self._step_ns)
        inputs = Inputs(self._odometry.rows, log.events, order, log.outcomes)
        waiting = last + 1 - self._wait_steps
        span = Span(first, last, waiting, self._seconds(now_ns))
        replay(self._event_kernels, self._tables, self._checkpoints, inputs, span, self._state, self._moments)
        self._velocities.clear()
        self._present = None
        self._now_ns, self._last, self._dirty = now_ns, last, min(waiting, last)
        self._log.forget_before(self._origin_ns + (last - self._behind) * self._step_ns)

    def _report(self) -> None:
        for row in self._log.reached(self._fresh):
            self._corrections.append(self._log.correction(row, *self._fresh.pop(row)))

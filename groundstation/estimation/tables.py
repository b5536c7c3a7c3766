"""Turns models into the flat tables of the compiled filter, and makes the arrays of its state."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from groundstation.arrays import LINE, Array, zeros_on_a_line
from groundstation.estimation import model_kernels as declared
from groundstation.estimation.chi_square import gate
from groundstation.estimation.deferred import MOST
from groundstation.estimation.filter_state import Checkpoints, Settings, State, Tables
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.models.protocol import MotionModel, ObservationModel, SwitchingModel, place_of
from groundstation.estimation.parameters import EstimatorParameters
from groundstation.estimation.records import (
    KIND_CAMERA,
    KIND_LANDMARK,
    KIND_ROBOT,
    KIND_TARGET,
    MAX_BLOCK,
    MAX_ROWS,
    SHARED_LABELS,
    EntityMemory,
    EntityRow,
    PriorRow,
    SensorRow,
)
from groundstation.kernel import Record, Rows, RowsStack, address_of

MOST_MODES = 8
_KINDS = {
    EntityKind.ROBOT: KIND_ROBOT,
    EntityKind.TARGET: KIND_TARGET,
    EntityKind.CAMERA: KIND_CAMERA,
    EntityKind.LANDMARK: KIND_LANDMARK,
}
_NEVER_S = -1e9


def tables_from_parameters(parameters: EstimatorParameters) -> Tables:
    """Return the tables; raises ValueError for incompatible models."""
    models = tuple(parameters.entities.values())
    sensors = tuple(parameters.sensors.values())
    for name, model in parameters.entities.items():
        if len(model.labels) > MAX_BLOCK:
            raise ValueError(f"{name}: more than {MAX_BLOCK} entries in one block")
    teams = list(product(*(m.modes if isinstance(m, SwitchingModel) else (m,) for m in models)))
    if len(teams) > MOST_MODES:
        raise ValueError(f"{len(teams)} joint beliefs are needed for all modes of all targets (at most {MOST_MODES})")
    gates = np.array([0.0, *(gate(parameters.gate_probability, rows) for rows in range(1, MAX_ROWS + 1))])
    entities = _entities(teams, len(models))
    starts, yaws = entities["start"][0], entities["at_yaw"][0]
    return Tables(
        entities=entities,
        priors=_priors(models),
        sensors=_sensors(sensors),
        settings=Settings(
            float(parameters.step_s),
            float(parameters.wild_gates),
            int(parameters.divergence_count),
            float(parameters.divergence_s),
            gates,
        ),
        transition=_transition(models, parameters.step_s),
        headings=(starts + yaws)[yaws >= 0],
    )


def _entities(teams: Sequence[tuple[MotionModel, ...]], count: int) -> RowsStack[EntityRow]:
    table = EntityRow.rows(len(teams), count)
    for rows, team in enumerate(teams):
        start = 0
        for e, model in enumerate(team):
            _describe(table[rows, e], model, start)
            start += len(model.labels)
    return table


def _describe(row: EntityRow, model: MotionModel, start: int) -> None:
    predict, begin = model.kernels
    row["predict"] = 0 if predict is None else address_of(predict, declared.predict)
    row["begin"] = 0 if begin is None else address_of(begin, declared.begin)
    row["start"], row["size"], row["kind"], row["present"] = start, len(model.labels), _KINDS[model.kind], model.present
    for label in SHARED_LABELS:
        row[f"at_{label}"] = place_of(model.labels, label)
    row["place_x"], row["place_y"], row["place_z"] = model.place_m
    _set_own(row, model.own())


def _set_own(row: EntityRow | SensorRow, own: Record | None) -> None:
    """Copy a model's own parameters word by word; raises ValueError where they do not fit."""
    if own is not None:
        words = np.frombuffer(np.asarray(own).tobytes(), dtype=np.int64)
        row["own"][: len(words)] = words


def _priors(models: Sequence[MotionModel]) -> Rows[PriorRow]:
    priors = PriorRow.rows(len(models))
    for row, model in zip(priors, models, strict=True):
        row["mean"][: len(model.labels)], row["variances"][: len(model.labels)] = model.prior()
    return priors


def _sensors(sensors: Sequence[ObservationModel]) -> Rows[SensorRow]:
    table = SensorRow.rows(len(sensors))
    for row, sensor in zip(table, sensors, strict=True):
        row["measure"] = address_of(sensor.kernels.measure, declared.measure)
        row["prepare"] = address_of(sensor.kernels.prepare, declared.prepare)
        row["locate"] = address_of(sensor.kernels.locate, declared.locate)
        row["is_angle"][list(sensor.angles)] = 1
        row["repeats_s"], row["stamp_variance_s2"] = sensor.repeats_s, sensor.stamp_std_s**2
        _set_own(row, sensor.own())
    return table


def _transition(models: tuple[MotionModel, ...], step_s: float) -> Array:
    """Return the chances (m, m) of going from one mode to another within a step; targets switch independently."""
    chances: Array = np.ones((1, 1))
    for model in models:
        if isinstance(model, SwitchingModel):
            stay = np.array([math.exp(-step_s / stay_s) for stay_s in model.stay_s])
            own = np.tile(((1.0 - stay) / (len(stay) - 1))[:, None], (1, len(stay)))
            np.fill_diagonal(own, stay)
            chances = np.asarray(np.kron(chances, own), dtype=np.float64)
    return chances


def width_of(tables: Tables) -> int:
    """Return the length of the arrays that hold the state: its dimension padded with zeros to whole cache lines.

    Aligned rows of P save a quarter of a correction's time.
    """
    return -(-tables.dim // LINE) * LINE


def empty_state(tables: Tables, admitted: Sequence[bool]) -> State:
    """Return the state before anything was measured; entities with a prior are in it.

    admitted: which entities may join.
    """
    modes, n, count = tables.modes, width_of(tables), len(tables.priors)
    state = State(
        zeros_on_a_line((modes, n)),
        zeros_on_a_line((modes, n, n)),
        np.full(modes, 1.0 / modes),
        EntityMemory.rows(count),
        np.full((len(tables.sensors), count), _NEVER_S),
        zeros_on_a_line((modes, MOST, n)),
        np.zeros((modes, 1), dtype=np.int64),
    )
    state.memory["admitted"] = admitted
    for index in np.flatnonzero(tables.entities["present"][0]):
        part, prior = tables.part(int(index)), tables.priors[int(index)]
        size = part.stop - part.start
        state.means[:, part] = prior["mean"][:size]
        state.covariances[:, part, part] = np.diag(prior["variances"][:size])
        state.memory["active"][index] = 1
    return state


def checkpoints_of(state: State, steps: int) -> Checkpoints:
    """Return a ring of copies of a state."""
    ring = Checkpoints(
        zeros_on_a_line((steps, *state.means.shape)),
        zeros_on_a_line((steps, *state.covariances.shape)),
        np.empty((steps, *state.weights.shape)),
        EntityMemory.rows(steps, len(state.memory)),
        np.empty((steps, *state.used_at.shape)),
    )
    for copies, value in zip(ring, state[: len(ring)], strict=True):
        np.asarray(copies)[:] = value
    return ring

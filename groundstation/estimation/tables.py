"""From models to the flat tables that the compiled filter works on, and the arrays that hold its state."""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.gating import gate
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.models.protocol import MotionModel, ObservationModel, SwitchingModel, place_of
from groundstation.estimation.parameters import EstimatorParameters

MOST_MODES = 8
_KINDS = {
    EntityKind.ROBOT: s.KIND_ROBOT,
    EntityKind.TARGET: s.KIND_TARGET,
    EntityKind.CAMERA: s.KIND_CAMERA,
    EntityKind.LANDMARK: s.KIND_LANDMARK,
}
_NEVER_S = -1e9
# Numbers in one line of the cache. Rows of P that begin on a line spare a quarter of a correction's time.
_LINE = 8


@dataclass(frozen=True, slots=True)
class Tables:
    """Everything that stays the same while the filter runs; a leading axis of m where modes differ."""

    entities: IntArray
    parameters: Array
    priors: Array
    kernels: IntArray
    sensors: Array
    settings: Array
    transition: Array

    @property
    def modes(self) -> int:
        """Return the number of joint beliefs that are kept."""
        return len(self.entities)

    @property
    def dim(self) -> int:
        """Return the dimension of the state."""
        return int(self.entities[0, :, s.ENTITY_SIZE].sum())

    @property
    def width(self) -> int:
        """Return the length of the arrays that hold the state: `dim` and entries that stay zero, in whole lines."""
        return -(-self.dim // _LINE) * _LINE

    def part(self, entity: int) -> slice:
        """Return where an entity's block stands in the state."""
        start = int(self.entities[0, entity, s.ENTITY_START])
        return slice(start, start + int(self.entities[0, entity, s.ENTITY_SIZE]))


def tables_from_parameters(parameters: EstimatorParameters) -> Tables:
    """Return the tables; raises ValueError for models that do not fit together."""
    models = tuple(parameters.entities.values())
    sensors = tuple(parameters.sensors.values())
    for name, model in parameters.entities.items():
        if len(model.labels) > s.MAX_BLOCK:
            raise ValueError(f"{name}: more than {s.MAX_BLOCK} entries in one block")
    teams = list(product(*(m.modes if isinstance(m, SwitchingModel) else (m,) for m in models)))
    if len(teams) > MOST_MODES:
        raise ValueError(f"{len(teams)} joint beliefs are needed for all modes of all targets (at most {MOST_MODES})")
    scalars = (parameters.step_s, parameters.wild_gates, parameters.divergence_count, parameters.divergence_s)
    gates = [gate(parameters.gate_probability, rows) for rows in range(1, 5)]
    kernels = np.array([sensor.kernels for sensor in sensors], dtype=np.int64)
    return Tables(
        entities=np.array([_entities(team) for team in teams], dtype=np.int64),
        parameters=np.array([[m.row() for m in team] for team in teams]).reshape(
            len(teams), len(models), s.PARAMETER_COLUMNS
        ),
        priors=np.array([_prior(m) for m in models]).reshape(len(models), 2, s.MAX_BLOCK),
        kernels=kernels.reshape(-1, s.SENSOR_KERNELS),
        sensors=np.array([_sensor(sensor) for sensor in sensors]).reshape(-1, s.SENSOR_COLUMNS),
        settings=np.array([*map(float, scalars), 0.0, *gates, 0.0]),
        transition=_transition(models, parameters.step_s),
    )


def _entities(models: tuple[MotionModel, ...]) -> list[list[int]]:
    rows, start = [], 0
    for model in models:
        shared = [place_of(model.labels, label) for label in s.SHARED_LABELS]
        rows.append([*model.kernels, start, len(model.labels), _KINDS[model.kind], int(model.present), *shared])
        start += len(model.labels)
    return rows


def _prior(model: MotionModel) -> Array:
    prior = np.zeros((2, s.MAX_BLOCK))
    prior[:, : len(model.labels)] = model.prior()
    return prior


def _sensor(sensor: ObservationModel) -> Array:
    row = sensor.row()
    for angle in sensor.angles:
        row[s.SENSOR_ANGLES + angle] = 1.0
    row[s.SENSOR_REPEAT_S] = sensor.repeats_s
    return row


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


@dataclass(slots=True)
class State:
    """Mean and covariance per mode, the modes' probabilities, and what is remembered of entities and pairs.

    Means and covariances are `Tables.width` wide. With a leading ring axis in checkpoints.
    Entities with a prior are in it from the start.
    """

    means: Array
    covariances: Array
    weights: Array
    aux: Array
    pairs: Array

    def arrays(self) -> tuple[Array, Array, Array, Array, Array]:
        """Return all arrays in the order that the kernels take them."""
        return self.means, self.covariances, self.weights, self.aux, self.pairs


def empty_state(tables: Tables, admitted: Array, leading: tuple[int, ...] = ()) -> State:
    """Return the state before anything was measured; admitted (entities): who may join."""
    modes, n, entities, sensors = tables.modes, tables.width, len(admitted), len(tables.sensors)
    state = State(
        _zeros_on_a_line((*leading, modes, n)),
        _zeros_on_a_line((*leading, modes, n, n)),
        np.full((*leading, modes), 1.0 / modes),
        np.zeros((*leading, entities, s.AUXILIARY_COLUMNS)),
        np.full((*leading, sensors, entities), _NEVER_S),
    )
    state.aux[..., s.ADMITTED] = admitted
    for index in np.flatnonzero(tables.entities[0, :, s.ENTITY_PRESENT]):
        part = tables.part(int(index))
        size = part.stop - part.start
        state.means[..., part] = tables.priors[index, 0, :size]
        state.covariances[..., part, part] = np.diag(tables.priors[index, 1, :size])
        state.aux[..., index, s.ACTIVE] = 1.0
    return state


def _zeros_on_a_line(shape: tuple[int, ...]) -> Array:
    size = math.prod(shape)
    room: Array = np.zeros(size + _LINE)
    first = -room.ctypes.data // room.itemsize % _LINE
    return room[first : first + size].reshape(shape)

"""Checks the model of a sensor: its Jacobians against central differences."""

import math

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.parameters import EstimatorParameters
from groundstation.estimation.records import EntityMemory, EventRow, Prediction
from groundstation.estimation.tables import tables_from_parameters

_STEP = 1e-6


def jacobian_error(parameters: EstimatorParameters, sensor: str, subject: str, mean: Array, rows: int) -> float:
    """Return the largest difference between a model's Jacobians (`rows` rows) and central differences at a mean (n).

    mean: of all entities of the parameters, in their order. Raises KeyError or ValueError for an unknown name.
    """
    tables, names, model = tables_from_parameters(parameters), list(parameters.entities), parameters.sensors[sensor]
    number, observer, seen = list(parameters.sensors).index(sensor), names.index(model.carrier), names.index(subject)
    event = EventRow.row(observer=observer, subject=seen, sensor=number, size=rows)

    def predicted(x: Array) -> Prediction:
        out = Prediction.row(size=rows)
        belief = Belief(x, np.zeros((0, 0)), tables.entities[0], EntityMemory.rows(len(names)))
        model.kernels.measure(belief, tables.sensors[number], event, out)
        return out

    at, H, numeric = predicted(mean), np.zeros((rows, len(mean))), np.zeros((rows, len(mean)))
    for block, entity in ((at["H_observer"], observer), (at["H_subject"], seen)):
        part = tables.part(entity)
        H[:, part] += block[:rows, : part.stop - part.start]
    for j in range(len(mean)):
        shift = _STEP * np.eye(len(mean))[j]
        change = predicted(mean + shift)["h"][:rows] - predicted(mean - shift)["h"][:rows]
        for angle in model.angles:
            change[angle] = math.remainder(change[angle], math.tau)
        numeric[:, j] = change / (2.0 * _STEP)
    return float(np.abs(H - numeric).max())

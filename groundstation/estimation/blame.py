"""Whom to blame for an observation far beyond the gate: marker, observer, outlier, or the belief of the subject."""

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.update import linearise


@kernel(
    "boolean(float64[::1], float64[:,::1], float64[:,::1], int64[:,::1], float64[:,::1], int64[::1], float64[::1],"
    " float64[::1], float64[::1], int64, float64[::1], float64[:,::1])"
)
def fits_another(
    mean: Array, P: Array, aux: Array, entities: IntArray, parameters: Array, kernels: IntArray, sensor: Array,
    settings: Array, event: Array, rows: int, z: Array, R: Array,
) -> bool:  # fmt: skip
    """Return whether what was seen is where the belief has another robot or target: its marker was misread."""
    subject, observer = int(event[s.EVENT_SUBJECT]), int(event[s.EVENT_OBSERVER])
    work, W, y, noise = np.zeros((4, 4, s.MAX_BLOCK)), np.empty((4, mean.shape[0])), np.zeros(4), np.empty((4, 4))
    found = False
    for other in range(entities.shape[0]):
        kind = entities[other, s.ENTITY_KIND]
        if other in (subject, observer) or aux[other, s.ACTIVE] == 0.0:
            continue
        if kind != s.KIND_ROBOT and kind != s.KIND_TARGET:
            continue
        shared = rows if rows < 4 or entities[other, s.AT_YAW] >= 0 else 3
        event[s.EVENT_SUBJECT] = other
        copy_matrix(R, noise)
        nis = linearise(mean, P, entities, parameters, kernels, sensor, event, shared, z, noise, work, W, y)
        found = found or 0.0 <= nis <= settings[s.SETTING_WILD] * settings[s.SETTING_GATE + shared]
    event[s.EVENT_SUBJECT] = subject
    return found


@kernel("boolean(float64[::1], float64[::1], float64)")
def is_doubted(aux: Array, settings: Array, at: float) -> bool:
    """Return whether an entity was itself seen far from its place, more than once and until just now."""
    return bool(aux[s.STREAK] >= 2.0 and at - aux[s.WILD_AT] <= settings[s.SETTING_STREAK_S])


@kernel("boolean(float64[::1], float64[::1], float64)")
def has_diverged(aux: Array, settings: Array, at: float) -> bool:
    """Count a wild innovation of one entity; True when they last long enough to blame the belief.

    `observe` ends the count when the entity is seen within the gate. What has joined by one observation and was never
    confirmed since has nothing to set against another.
    """
    if aux[s.UNCONFIRMED] != 0.0:
        return True
    if aux[s.STREAK] == 0.0:
        aux[s.STREAK_START] = at
    aux[s.STREAK] += 1.0
    aux[s.WILD_AT] = at
    lasting = at - aux[s.STREAK_START] >= settings[s.SETTING_STREAK_S]
    return bool(lasting and aux[s.STREAK] >= settings[s.SETTING_STREAK])


@kernel(
    "int64(float64[::1], float64[:,::1], float64[:,::1], int64[:,::1], float64[:,::1], int64[::1], float64[::1],"
    " float64[::1], float64[::1], int64, float64[::1], float64[:,::1])"
)
def blame(
    mean: Array, P: Array, aux: Array, entities: IntArray, parameters: Array, kernels: IntArray, sensor: Array,
    settings: Array, event: Array, rows: int, z: Array, R: Array,
) -> int:  # fmt: skip
    """Return why a wild observation is refused, or PENDING when the subject's belief is to be given up for it."""
    if is_doubted(aux[int(event[s.EVENT_OBSERVER])], settings, event[s.EVENT_AT]):
        return s.OBSERVER_DOUBTED
    if fits_another(mean, P, aux, entities, parameters, kernels, sensor, settings, event, rows, z, R):
        return s.MISTAKEN
    return s.PENDING if has_diverged(aux[int(event[s.EVENT_SUBJECT])], settings, event[s.EVENT_AT]) else s.IMPLAUSIBLE

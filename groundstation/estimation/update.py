"""One observation against one joint mean and covariance: reading it, its innovation, and the correction."""

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.correction import apply, bound_precision, inflate, project, project_columns, surprise
from groundstation.estimation.dispatch import call_measure, call_prepare
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import cholesky, wrap

_SHORTEST_S = 1e-3  # between two readings of one pair, as far as repeated errors are concerned


@kernel(
    "int64(int64[:,::1], float64[:,::1], int64[::1], float64[::1], float64, float64[::1], int64, float64[::1],"
    " float64[:,::1])",
    inlined=True,
)
def read(
    entities: IntArray, parameters: Array, kernels: IntArray, sensor: Array, unused_s: float, event: Array,
    offset: int, z: Array, R: Array,
) -> int:  # fmt: skip
    """Write z and R of the hypothesis at an offset of the event; returns its rows, or minus a verdict.

    unused_s: since the same sensor's last reading of the same subject; a repeated error makes R larger by what that
    falls short of the sensor's `repeats_s`, so that all readings within it share one reading's information.
    """
    factor = np.empty((4, 4))
    for i in range(4):
        z[i] = event[offset + i]
        for j in range(4):
            R[i, j] = 0.5 * (event[offset + 4 + 4 * i + j] + event[offset + 4 + 4 * j + i])
            factor[i, j] = R[i, j]
    rows = call_prepare(kernels[s.SENSOR_PREPARE], (entities, parameters, sensor, event, z, R))
    if rows < 0:
        return int(rows)
    if rows > int(event[s.EVENT_SIZE]) or not cholesky(factor, rows):
        return -s.SINGULAR
    repeat = sensor[s.SENSOR_REPEAT_S] / max(unused_s, _SHORTEST_S)
    if repeat > 1.0:
        for i in range(rows):
            for j in range(rows):
                R[i, j] *= repeat
    return int(rows)


@kernel("void(float64[::1], float64[::1], int64[::1], float64[::1], int64)", inlined=True)
def note_rates(mean: Array, aux: Array, entity: IntArray, event: Array, offset: int) -> None:
    """Write into the event how fast the first four entries of one entity's block change."""
    for i in range(4):
        event[offset + i] = 0.0
    if entity[s.ENTITY_KIND] == s.KIND_ROBOT:
        event[offset], event[offset + 1], event[offset + 2] = aux[s.RATE_X], aux[s.RATE_Y], aux[s.RATE_Z]
        event[offset + s.YAW] = aux[s.YAW_RATE]
    elif entity[s.ENTITY_KIND] == s.KIND_TARGET:
        event[offset] = mean[entity[s.ENTITY_START] + s.VX]
        event[offset + 1] = mean[entity[s.ENTITY_START] + s.VY]


@kernel("void(float64[::1], float64[:,::1], int64[:,::1], float64[::1])", inlined=True)
def note_motion(mean: Array, aux: Array, entities: IntArray, event: Array) -> None:
    """Complete an event by what is known when it is reached: how its subject leans, how fast both move."""
    observer, subject = int(event[s.EVENT_OBSERVER]), int(event[s.EVENT_SUBJECT])
    event[s.EVENT_SUBJECT_ROLL], event[s.EVENT_SUBJECT_PITCH] = aux[subject, s.HELD_ROLL], aux[subject, s.HELD_PITCH]
    note_rates(mean, aux[observer], entities[observer], event, s.EVENT_OBSERVER_RATE)
    note_rates(mean, aux[subject], entities[subject], event, s.EVENT_SUBJECT_RATE)


@kernel("void(float64[::1], float64[::1], int64, float64[:,::1], float64[:,::1], float64[:,::1])", inlined=True)
def add_timing_noise(sensor: Array, event: Array, rows: int, H_observer: Array, H_subject: Array, R: Array) -> None:
    """Add to R what an uncertain time of measurement does while observer and subject move: var(t) h' h'^T."""
    if sensor[s.SENSOR_TIME_VARIANCE] == 0.0:
        return
    rate = np.zeros(rows)
    for i in range(rows):
        for j in range(4):
            rate[i] += H_observer[i, j] * event[s.EVENT_OBSERVER_RATE + j]
            rate[i] += H_subject[i, j] * event[s.EVENT_SUBJECT_RATE + j]
    for i in range(rows):
        for j in range(rows):
            R[i, j] += sensor[s.SENSOR_TIME_VARIANCE] * rate[i] * rate[j]


@kernel(
    "float64(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1], int64[::1], float64[::1], float64[::1],"
    " int64, float64[::1], float64[:,::1], float64[:,:,::1], float64[:,::1], float64[::1])",
    inlined=True,
)
def linearise(
    mean: Array, P: Array, entities: IntArray, parameters: Array, kernels: IntArray, sensor: Array, event: Array,
    rows: int, z: Array, R: Array, work: Array, W: Array, y: Array,
) -> float:  # fmt: skip
    """Write y = z - h(x), W = H P and, into work, H of both blocks, H P H^T and the factor of S; the NIS, or -1."""
    observer, subject = int(event[s.EVENT_OBSERVER]), int(event[s.EVENT_SUBJECT])
    start, size = entities[subject, s.ENTITY_START], entities[subject, s.ENTITY_SIZE]
    start_o, size_o = entities[observer, s.ENTITY_START], entities[observer, s.ENTITY_SIZE]
    h = np.zeros(4)
    for i in range(4):
        for j in range(s.MAX_BLOCK):
            work[0, i, j] = work[1, i, j] = 0.0
    call_measure(kernels[s.SENSOR_MEASURE], (mean, entities, parameters, sensor, event, rows, h, work[0], work[1]))
    for i in range(rows):
        y[i] = z[i] - h[i]
        if sensor[s.SENSOR_ANGLES + i] != 0.0:
            y[i] = wrap(y[i])
    add_timing_noise(sensor, event, rows, work[0], work[1], R)
    project(P, start_o, size_o, work[0], start, size, work[1], rows, W)
    project_columns(W[:rows], start_o, size_o, work[0], start, size, work[1], rows, work[2])
    bound_precision(work[2], R, rows)
    return surprise(work[2], R, y, rows, work[3])


@kernel(
    "void(float64[::1], float64[:,::1], int64[:,::1], int64, float64[:,::1], float64[:,:,::1], float64[:,::1],"
    " float64[::1], float64)",
    inlined=True,
)
def correct(
    mean: Array, P: Array, entities: IntArray, rows: int, R: Array, work: Array, W: Array, y: Array, factor: float
) -> None:
    """Apply what `linearise` prepared, with S inflated by a factor >= 1; wraps all headings."""
    if factor > 1.0:
        inflate(work[2], R, rows, factor)
        surprise(work[2], R, y, rows, work[3])
    apply(mean, P, rows, W, work[3], y)
    for e in range(entities.shape[0]):
        if entities[e, s.AT_YAW] >= 0:
            yaw = entities[e, s.ENTITY_START] + entities[e, s.AT_YAW]
            mean[yaw] = wrap(mean[yaw])


@kernel("void(float64[::1], float64, int64, float64[::1], float64[:,:,::1])", inlined=True)
def write_outcome(out: Array, nis: float, rows: int, y: Array, work: Array) -> None:
    """Record residual, S and NIS, so that each correction can explain itself."""
    out[s.OUT_NIS] = nis
    out[s.OUT_SIZE] = rows
    for i in range(rows):
        out[s.OUT_RESIDUAL + i] = y[i]
        for j in range(rows):
            total = 0.0
            for k in range(min(i, j) + 1):
                total += work[3, i, k] * work[3, j, k]
            out[s.OUT_COVARIANCE + rows * i + j] = total

"""One observation against one joint mean and covariance: reading it, its innovation, and the correction."""

import numpy as np

from groundstation.arrays import IntVector, Matrix, Vector
from groundstation.estimation.correction import (
    Jacobian,
    apply,
    bound_precision,
    gather,
    inflate,
    measured_covariance,
    project,
    surprise,
)
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.estimation.linear import cholesky, wrap
from groundstation.estimation.model_kernels import call_measure, call_prepare
from groundstation.estimation.records import (
    KIND_ROBOT,
    KIND_TARGET,
    MAX_BLOCK,
    MAX_ROWS,
    POSE,
    SINGULAR,
    VX,
    VY,
    YAW,
    EntityRow,
    EventRow,
    Innovation,
    OutcomeRow,
    RawReading,
    SensorRow,
    X,
    Y,
    Z,
)
from groundstation.kernel import kernel

_SHORTEST_S = 1e-3  # least time between two readings of one pair, for repeated errors


@kernel(inlined=True)
def read(
    belief: Belief, sensor: SensorRow, event: EventRow, raw: RawReading, unused_s: float, z: Vector, R: Matrix
) -> int:
    """Write z and R of one hypothesis of the event; returns its rows, or minus a verdict.

    unused_s: time since the same sensor's last reading of the same subject; if it is shorter than the sensor's
    `repeats_s`, R is enlarged so that all readings within that share one reading's information.
    """
    factor = np.empty((MAX_ROWS, MAX_ROWS))
    for i in range(MAX_ROWS):
        z[i] = raw.z[i]
        for j in range(MAX_ROWS):
            R[i, j] = 0.5 * (raw.R[i, j] + raw.R[j, i])
            factor[i, j] = R[i, j]
    rows = int(call_prepare(sensor.prepare, (belief, sensor, event, z, R)))
    if rows < 0:
        return rows
    if rows > event.size or not cholesky(factor, rows):
        return -SINGULAR
    repeat = sensor.repeats_s / max(unused_s, _SHORTEST_S)
    if repeat > 1.0:
        for i in range(rows):
            for j in range(rows):
                R[i, j] *= repeat
    return rows


@kernel(inlined=True)
def note_rates(belief: Belief, e: int, rates: Vector) -> None:
    """Write the rates of change of the first four entries of one entity's block."""
    entity, memory = belief.entities[e], belief.memory[e]
    for i in range(POSE):
        rates[i] = 0.0
    if entity.kind == KIND_ROBOT:
        rates[X], rates[Y], rates[Z] = memory.velocity_x, memory.velocity_y, memory.velocity_z
        rates[YAW] = memory.yaw_rate
    elif entity.kind == KIND_TARGET:
        rates[X] = belief.mean[entity.start + VX]
        rates[Y] = belief.mean[entity.start + VY]


@kernel(inlined=True)
def note_motion(belief: Belief, event: EventRow) -> None:
    """Complete an event by data known when it is reached: roll and pitch of its subject, rates of both blocks."""
    subject = belief.memory[event.subject]
    event.subject_roll, event.subject_pitch = subject.held_roll, subject.held_pitch
    note_rates(belief, event.observer, event.observer_rates)
    note_rates(belief, event.subject, event.subject_rates)


@kernel(inlined=True)
def add_timing_noise(sensor: SensorRow, event: EventRow, innovation: Innovation) -> None:
    """Add to R the effect of an uncertain measurement time while observer and subject move: var(t) h' h'^T."""
    if sensor.stamp_variance_s2 == 0.0:
        return
    rows = innovation.prediction.size
    rate = np.zeros(rows)
    for i in range(rows):
        for j in range(POSE):
            rate[i] += innovation.prediction.H_observer[i, j] * event.observer_rates[j]
            rate[i] += innovation.prediction.H_subject[i, j] * event.subject_rates[j]
    for i in range(rows):
        for j in range(rows):
            innovation.R[i, j] += sensor.stamp_variance_s2 * rate[i] * rate[j]


@kernel(inlined=True)
def linearise(
    belief: Belief, deferred: Deferred, sensor: SensorRow, event: EventRow, rows: int, z: Vector,
    innovation: Innovation, HP: Matrix,
) -> None:  # fmt: skip
    """Write HP = H P and the innovation of z, with its given R, enlarged by the timing noise."""
    observer, subject, out = belief.entities[event.observer], belief.entities[event.subject], innovation.prediction
    out.size = rows
    for i in range(MAX_ROWS):
        out.h[i] = 0.0
        for j in range(MAX_BLOCK):
            out.H_observer[i, j] = out.H_subject[i, j] = 0.0
    call_measure(sensor.measure, (belief, sensor, event, out))
    for i in range(rows):
        innovation.y[i] = z[i] - out.h[i]
        if sensor.is_angle[i] != 0:
            innovation.y[i] = wrap(innovation.y[i])
    add_timing_noise(sensor, event, innovation)
    jacobian = Jacobian(np.empty((MAX_ROWS, 2 * MAX_BLOCK)), np.empty(2 * MAX_BLOCK, np.int64))
    count = gather(subject, out.H_subject, jacobian, gather(observer, out.H_observer, jacobian, 0))
    project(belief, deferred, jacobian, count, HP)
    measured_covariance(HP, jacobian, count, rows, innovation.HPH)
    bound_precision(innovation.HPH, innovation.R, rows)
    innovation.nis = surprise(innovation.HPH, innovation.R, innovation.y, rows, innovation.factor)


@kernel(inlined=True)
def correct(
    belief: Belief, deferred: Deferred, headings: IntVector, innovation: Innovation, HP: Matrix, factor: float
) -> None:
    """Apply a linearised correction, with S inflated by a factor >= 1; wraps all headings."""
    rows = innovation.prediction.size
    if factor > 1.0:
        inflate(innovation.HPH, innovation.R, rows, factor)
        surprise(innovation.HPH, innovation.R, innovation.y, rows, innovation.factor)
    apply(belief.mean, belief.P, deferred, rows, HP, innovation.factor, innovation.y)
    for i in range(headings.shape[0]):
        belief.mean[headings[i]] = wrap(belief.mean[headings[i]])


@kernel(inlined=True)
def write_outcome(out: OutcomeRow, innovation: Innovation) -> None:
    """Record residual, S and NIS, so that each correction can explain itself."""
    rows = innovation.prediction.size
    out.nis = innovation.nis
    out.size = rows
    for i in range(rows):
        out.residual[i] = innovation.y[i]
        for j in range(rows):
            total = 0.0
            for k in range(min(i, j) + 1):
                total += innovation.factor[i, k] * innovation.factor[j, k]
            out.covariance[rows * i + j] = total


@kernel()
def write_ahead(out: OutcomeRow, entity: EntityRow, innovation: Innovation) -> None:
    """Record a target sighting's offset from the belief: H^T S^-1 y over x and y, whitened by its own covariance."""
    rows, H, factor = innovation.prediction.size, innovation.prediction.H_subject, innovation.factor
    if entity.kind != KIND_TARGET:
        return
    # L^-1 of the columns (H_x, H_y, y), S = L L^T
    solved = np.empty((MAX_ROWS, 3))
    for i in range(rows):
        solved[i, 0], solved[i, 1], solved[i, 2] = H[i, X], H[i, Y], innovation.y[i]
        for j in range(3):
            for k in range(i):
                solved[i, j] -= factor[i, k] * solved[k, j]
            solved[i, j] /= factor[i, i]
    information, score = np.zeros((2, 2)), np.zeros(2)
    for i in range(rows):
        for a in range(2):
            score[a] += solved[i, a] * solved[i, 2]
            for b in range(2):
                information[a, b] += solved[i, a] * solved[i, b]
    if cholesky(information, 2):
        out.ahead_x = score[0] / information[0, 0]
        out.ahead_y = (score[1] - information[1, 0] * out.ahead_x) / information[1, 1]

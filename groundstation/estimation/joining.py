"""Lets an entity join (again) where one observation puts it, unless that contradicts the observer; compiled.

A measurement often has more rows than the subject has unknowns: three rows determine a target's place (x, y). The
surplus tests the observer, and is gated. With S = S_0 + H D H^T, D being the diffuse prior of `join`, the NIS y^T S^-1
y is the least of |y - H d|^2 (whitened by S_0) + d^T D^-1 d over all shifts d of the subject. D is so wide that this is
the NIS of y projected on the null space of H^T: chi-square with as many degrees of freedom as there are surplus rows,
to 0.01 for a shift of 1 m.
"""

import numpy as np

from groundstation.arrays import IntVector, Matrix, Vector
from groundstation.estimation.correction import surprise
from groundstation.estimation.evidence import confront, least_nis, likeliest, set_noise
from groundstation.estimation.filter_state import Hypothesis, State, Tables, belief_of
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.model_kernels import call_locate
from groundstation.estimation.motion import join
from groundstation.estimation.outliers import insists
from groundstation.estimation.records import (
    ACCEPTED,
    CONTRADICTED,
    INFLATED,
    NOT_LOCATED,
    POSE,
    SINGULAR,
    EntityMemory,
    EntityRow,
    EventRow,
    Innovation,
    X,
    Y,
)
from groundstation.kernel import kernel

_UNSEEN = 1e-6  # a smaller derivative by a pose entry gives no information on it


@kernel(inlined=True)
def pose_entries(entity: EntityRow, at: IntVector) -> None:
    """Write the positions of x, y, z, yaw in a block (-1: none): the entries that join with a diffuse prior."""
    at[0], at[1], at[2], at[3] = X, Y, entity.at_z, entity.at_yaw


@kernel()
def surplus(entity: EntityRow, H: Matrix, rows: int) -> int:
    """Return the number of rows of a measurement beyond those that place its subject.

    H (rows, block): by the subject.
    """
    at, left = np.empty(POSE, np.int64), rows
    pose_entries(entity, at)
    for k in at:
        seen = False
        for i in range(rows):
            if k >= 0 and abs(H[i, k]) > _UNSEEN:
                seen = True
        left -= int(seen)
    return max(left, 0)


@kernel()
def soften(P: Matrix, entity: EntityRow, innovation: Innovation, factor: float) -> None:
    """Raise R so that S, without the part from the subject's diffuse prior, grows by `factor`."""
    at, rows, H = np.empty(POSE, np.int64), innovation.prediction.size, innovation.prediction.H_subject
    pose_entries(entity, at)
    for i in range(rows):
        for j in range(rows):
            known = 0.5 * (innovation.HPH[i, j] + innovation.HPH[j, i])
            for k in at:
                if k >= 0:
                    known -= P[entity.start + k, entity.start + k] * H[i, k] * H[j, k]
            innovation.R[i, j] = factor * innovation.R[i, j] + (factor - 1.0) * known


@kernel()
def settle(state: State, tables: Tables, event: EventRow, z: Vector) -> bool:
    """Put the subject where the measurement has it, in all modes, diffuse until the following correction."""
    sensor, pose = tables.sensors[event.sensor], np.zeros(POSE)
    for m in range(state.means.shape[0]):
        belief = belief_of(state, tables, m)
        if not call_locate(sensor.locate, (belief, sensor, event, z, pose)):
            return False
        join(belief, event.subject, tables.priors[event.subject], pose)
    return True


@kernel(inlined=True)
def note_joining(memory: EntityMemory) -> None:
    """Note that an entity joined: without contradictions so far, and not yet confirmed."""
    memory.active = memory.unconfirmed = 1
    memory.wild.count = memory.astray.count = memory.refused.count = 0


@kernel()
def admit(state: State, tables: Tables, event: EventRow, rows: int, hypothesis: Hypothesis) -> int:
    """Let the subject join and prepare the innovations for `correct`; or return why not, the belief unchanged.

    No correction is deferred when it is called. CONTRADICTED: the surplus lies beyond the gate. After enough of these
    in a row the subject joins nevertheless (INFLATED), with R raised until the surplus lies on the gate.
    """
    memory, settings = state.memory[event.subject], tables.settings
    trial = State(
        state.means.copy(),
        state.covariances.copy(),
        state.weights,
        state.memory,
        state.used_at,
        state.deferred,
        state.deferred_used,
    )
    if not settle(trial, tables, event, hypothesis.z):
        return NOT_LOCATED
    set_noise(hypothesis.innovations, hypothesis.R)  # without the timing noise that an earlier linearisation added
    confront(trial, tables, event, rows, hypothesis)
    mode = likeliest(state.weights, hypothesis.innovations)
    if mode < 0:
        return SINGULAR
    subject, excess = tables.entities[mode, event.subject], 1.0
    left = surplus(subject, hypothesis.innovations[mode].prediction.H_subject, rows)
    if left > 0:
        excess = max(1.0, least_nis(hypothesis.innovations) / settings.gates[left])
    if excess > 1.0 and not insists(memory.refused, settings, event.at):
        return CONTRADICTED
    note_joining(memory)
    copy_matrix(trial.means, state.means)
    for m in range(state.means.shape[0]):
        copy_matrix(trial.covariances[m], state.covariances[m])
        if excess > 1.0:
            innovation = hypothesis.innovations[m]
            soften(trial.covariances[m], tables.entities[m, event.subject], innovation, excess)
            innovation.nis = surprise(innovation.HPH, innovation.R, innovation.y, rows, innovation.factor)
    return INFLATED if excess > 1.0 else ACCEPTED

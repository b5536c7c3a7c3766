"""What happens at one measurement time: an observation, or a change of who is in the state; compiled.

Arrays with a leading axis hold one belief per mode (modes.py): means (m, n), covariances (m, n, n), weights (m),
entities and parameters (m, entities, columns). What is decided (gate, hypothesis, joining) is decided for all modes.
"""

import math

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.blame import blame
from groundstation.estimation.correction import log_determinant
from groundstation.estimation.dispatch import HANDLE, call_locate
from groundstation.estimation.kernel import address_of, kernel
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.motion import clear, enter, join
from groundstation.estimation.update import correct, linearise, note_motion, read, write_outcome


@kernel("int64(int64[:,::1], float64[:,::1], float64[::1], int64)", inlined=True)
def refusal(entities: IntArray, aux: Array, event: Array, rows: int) -> int:
    """Return why an observation cannot be used whatever it says, or PENDING."""
    observer, subject = int(event[s.EVENT_OBSERVER]), int(event[s.EVENT_SUBJECT])
    if aux[observer, s.ACTIVE] == 0.0:
        return s.OBSERVER_UNKNOWN
    if aux[observer, s.UNCONFIRMED] != 0.0:
        return s.OBSERVER_UNCONFIRMED
    if aux[subject, s.ADMITTED] == 0.0:
        return s.SUBJECT_GROUNDED
    if aux[subject, s.ACTIVE] == 0.0 and entities[subject, s.ENTITY_KIND] == s.KIND_ROBOT and rows < 4:
        return s.YAW_MISSING
    return s.PENDING


@kernel(
    "float64(float64[:,::1], float64[:,:,::1], float64[::1], int64[:,:,::1], float64[:,:,::1], int64[::1],"
    " float64[::1], float64[::1], int64, float64[::1], float64[:,:,::1], float64[:,:,:,::1], float64[:,:,::1],"
    " float64[:,::1], float64[::1])"
)
def confront(
    means: Array, covariances: Array, weights: Array, entities: IntArray, parameters: Array, kernels: IntArray,
    sensor: Array, event: Array, rows: int, z: Array, R: Array, work: Array, W: Array, y: Array, nis: Array,
) -> float:  # fmt: skip
    """Linearise in all modes; writes the NIS of each (-1: S not PD) and returns the log evidence of the hypothesis."""
    modes = means.shape[0]
    scores, best = np.empty(modes), -math.inf
    for m in range(modes):
        nis[m] = linearise(
            means[m], covariances[m], entities[m], parameters[m], kernels, sensor, event, rows, z, R[m], work[m], W[m],
            y[m],
        )  # fmt: skip
        scores[m] = -math.inf
        if nis[m] >= 0.0:
            scores[m] = math.log(max(weights[m], 1e-300)) - 0.5 * (nis[m] + log_determinant(work[m, 3], rows))
        best = max(best, scores[m])
    if best == -math.inf:
        return best
    total = 0.0
    for m in range(modes):
        total += math.exp(scores[m] - best)
    return best + math.log(total)


@kernel("void(float64[::1], float64[::1], float64[:,:,:,::1], int64, float64)", inlined=True)
def weigh(weights: Array, nis: Array, work: Array, rows: int, factor: float) -> None:
    """Multiply the modes' probabilities by the likelihood of the observation as it was used (S times factor)."""
    modes = weights.shape[0]
    if modes == 1:
        return
    scores, best = np.empty(modes), -math.inf
    for m in range(modes):
        scores[m] = math.log(max(weights[m], 1e-300)) - 0.5 * (nis[m] / factor + log_determinant(work[m, 3], rows))
        best = max(best, scores[m])
    total = 0.0
    for m in range(modes):
        weights[m] = math.exp(scores[m] - best)
        total += weights[m]
    for m in range(modes):
        weights[m] /= total


@kernel(
    "boolean(float64[:,::1], float64[:,:,::1], float64[:,::1], int64[:,:,::1], float64[:,:,::1], float64[:,:,::1],"
    " int64[::1], float64[::1], float64[::1], float64[::1])"
)
def settle(
    means: Array, covariances: Array, aux: Array, entities: IntArray, parameters: Array, priors: Array,
    kernels: IntArray, sensor: Array, event: Array, z: Array,
) -> bool:  # fmt: skip
    """Let the subject join (again) where the measurement puts it, diffuse until the correction that follows."""
    subject, pose = int(event[s.EVENT_SUBJECT]), np.zeros(4)
    for m in range(means.shape[0]):
        arguments = (means[m], entities[m], parameters[m], sensor, event, z, pose)
        if call_locate(kernels[s.SENSOR_LOCATE], arguments) == 0:
            return False
        join(means[m], covariances[m], entities[m, subject], priors[subject], pose)
    aux[subject, s.ACTIVE] = 1.0
    aux[subject, s.JOINED_AT] = event[s.EVENT_AT]
    aux[subject, s.STREAK], aux[subject, s.UNCONFIRMED] = 0.0, 1.0
    return True


@kernel("int64(float64[::1], float64[::1])", inlined=True)
def likeliest(weights: Array, nis: Array) -> int:
    """Return the most probable mode in which the observation can be used, or -1."""
    best = -1
    for m in range(weights.shape[0]):
        if nis[m] >= 0.0 and (best < 0 or weights[m] > weights[best]):
            best = m
    return best


@kernel("float64(float64[::1])", inlined=True)
def least(nis: Array) -> float:
    """Return the smallest NIS of the modes in which the observation can be used."""
    value = math.inf
    for m in range(nis.shape[0]):
        if 0.0 <= nis[m] < value:
            value = nis[m]
    return value


@kernel(
    "int64(float64[:,::1], float64[:,:,::1], float64[::1], int64[:,:,::1], float64[:,:,::1], int64[::1],"
    " float64[::1], float64, float64[::1], int64, float64[:,::1], float64[:,:,:,::1], float64[:,:,:,:,::1],"
    " float64[:,:,:,::1], float64[:,:,::1], float64[:,::1])",
    inlined=True,
)
def choose(
    means: Array, covariances: Array, weights: Array, entities: IntArray, parameters: Array, kernels: IntArray,
    sensor: Array, unused_s: float, event: Array, rows: int, z: Array, R: Array, work: Array, W: Array, y: Array,
    nis: Array,
) -> int:  # fmt: skip
    """Confront the belief with the pose as measured and, if there is one, its alternative; 1 if that is likelier."""
    evidence = confront(
        means, covariances, weights, entities, parameters, kernels, sensor, event, rows, z[0], R[0], work[0], W[0],
        y[0], nis[0],
    )  # fmt: skip
    if event[s.EVENT_HAS_OTHER] == 0.0 or evidence == -math.inf:
        return 0
    if read(entities[0], parameters[0], kernels, sensor, unused_s, event, s.EVENT_OTHER, z[1], R[1, 0]) != rows:
        return 0
    for m in range(1, means.shape[0]):
        copy_matrix(R[1, 0], R[1, m])
    other = confront(
        means, covariances, weights, entities, parameters, kernels, sensor, event, rows, z[1], R[1], work[1], W[1],
        y[1], nis[1],
    )  # fmt: skip
    return 1 if other > evidence else 0


@kernel(HANDLE)
def observe(
    means: Array, covariances: Array, weights: Array, aux: Array, entities: IntArray, parameters: Array,
    priors: Array, kernels: IntArray, sensors: Array, pairs: Array, settings: Array, event: Array, out: Array,
) -> None:  # fmt: skip
    """Correct by one observation, or say why not: gate, choice of hypothesis, joining, re-initialisation."""
    modes, subject, number = means.shape[0], int(event[s.EVENT_SUBJECT]), int(event[s.EVENT_SENSOR])
    sensor, own, at = sensors[number], kernels[number], event[s.EVENT_AT]
    # First axis: the pose as measured, and its alternative.
    z, R, y, nis = np.zeros((2, 4)), np.zeros((2, modes, 4, 4)), np.zeros((2, modes, 4)), np.zeros((2, modes))
    work, W = np.zeros((2, modes, 4, 4, s.MAX_BLOCK)), np.empty((2, modes, 4, means.shape[1]))
    unused_s, use = at - pairs[number, subject], 0
    note_motion(means[0], aux, entities[0], event)
    out[s.OUT_JOINED] = out[s.OUT_OTHER_CHOSEN] = 0.0
    rows = read(entities[0], parameters[0], own, sensor, unused_s, event, s.EVENT_Z, z[0], R[0, 0])
    out[s.OUT_VERDICT] = -rows if rows < 0 else refusal(entities[0], aux, event, rows)
    if out[s.OUT_VERDICT] != s.PENDING:
        return
    for m in range(1, modes):
        copy_matrix(R[0, 0], R[0, m])
    gate, joined, excess = settings[s.SETTING_GATE + rows], aux[subject, s.ACTIVE] == 0.0, 1.0
    if not joined:
        use = choose(
            means, covariances, weights, entities, parameters, own, sensor, unused_s, event, rows, z, R, work, W, y, nis
        )
        out[s.OUT_OTHER_CHOSEN] = use
        mode = likeliest(weights, nis[use])
        if mode < 0:
            out[s.OUT_VERDICT] = s.SINGULAR
            return
        write_outcome(out, nis[use, mode], rows, y[use, mode], work[use, mode])
        excess = least(nis[use]) / gate
        if excess > settings[s.SETTING_WILD]:
            out[s.OUT_VERDICT] = blame(
                means[0], covariances[0], aux, entities[0], parameters[0], own, sensor, settings, event, rows, z[use],
                R[use, 0],
            )  # fmt: skip
            if out[s.OUT_VERDICT] != s.PENDING:
                return
            joined = True
        elif excess <= 1.0:
            aux[subject, s.STREAK] = aux[subject, s.UNCONFIRMED] = 0.0
    if joined:
        if not settle(means, covariances, aux, entities, parameters, priors, own, sensor, event, z[use]):
            out[s.OUT_VERDICT] = s.NOT_LOCATED
            return
        confront(
            means, covariances, weights, entities, parameters, own, sensor, event, rows, z[use], R[use], work[use],
            W[use], y[use], nis[use],
        )  # fmt: skip
        excess = 1.0
        out[s.OUT_JOINED] = 1.0
    excess = max(excess, 1.0)
    for m in range(modes):
        correct(means[m], covariances[m], entities[m], rows, R[use, m], work[use, m], W[use, m], y[use, m], excess)
    weigh(weights, nis[use], work[use], rows, excess)
    aux[subject, s.CORRECTED_AT] = at
    pairs[number, subject] = at
    out[s.OUT_VERDICT] = s.INFLATED if excess > 1.0 else s.ACCEPTED


@kernel("void(float64[::1], float64[:,::1], int64[::1], float64[:,::1], float64[::1])")
def place(mean: Array, P: Array, entity: IntArray, prior: Array, event: Array) -> None:
    """Put an entity where the event says (x, y, z, yaw) and as surely, independent of all others."""
    index, pose = np.empty(4, np.int64), np.empty(4)
    for i in range(4):
        pose[i] = event[s.EVENT_Z + i]
    join(mean, P, entity, prior, pose)
    at = (s.X, s.Y, entity[s.AT_Z], entity[s.AT_YAW])
    for i in range(4):
        index[i] = entity[s.ENTITY_START] + at[i] if at[i] >= 0 else -1
    for i in range(4):
        for j in range(4):
            if index[i] >= 0 and index[j] >= 0:
                P[index[i], index[j]] = event[s.EVENT_Z + 4 + 4 * i + j]


@kernel(HANDLE)
def change(
    means: Array, covariances: Array, weights: Array, aux: Array, entities: IntArray, parameters: Array,
    priors: Array, kernels: IntArray, sensors: Array, pairs: Array, settings: Array, event: Array, out: Array,
) -> None:  # fmt: skip
    """Let an entity in, out, or put it somewhere."""
    kind, subject = int(event[s.EVENT_KIND]), int(event[s.EVENT_SUBJECT])
    out[s.OUT_VERDICT] = s.ACCEPTED
    known = aux[subject, s.ACTIVE] != 0.0
    enters = kind == s.EVENT_PLACED or (kind == s.EVENT_ADMITTED and entities[0, subject, s.ENTITY_PRESENT] != 0)
    aux[subject, s.ADMITTED] = 0.0 if kind == s.EVENT_DISMISSED else 1.0
    for m in range(means.shape[0]):
        if kind == s.EVENT_DISMISSED:
            clear(means[m], covariances[m], entities[m, subject])
        elif kind == s.EVENT_PLACED:
            place(means[m], covariances[m], entities[m, subject], priors[subject], event)
        elif enters and not known:
            enter(means[m], covariances[m], entities[m, subject], priors[subject])
    if kind == s.EVENT_DISMISSED:
        aux[subject, s.ACTIVE] = 0.0
    elif enters:
        aux[subject, s.ACTIVE] = 1.0
        aux[subject, s.STREAK] = aux[subject, s.UNCONFIRMED] = 0.0
        aux[subject, s.JOINED_AT] = aux[subject, s.CORRECTED_AT] = event[s.EVENT_AT]


def event_kernels() -> IntArray:
    """Return where the kernel for each kind of event is: `replay` calls it there."""
    kernels = np.full(s.EVENT_KINDS, address_of(change))
    kernels[s.EVENT_OBSERVATION] = address_of(observe)
    return kernels

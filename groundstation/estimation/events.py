"""What happens at one measurement time: an observation, a take-off, a landing; compiled."""

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.correction import (
    apply,
    bound_precision,
    inflate,
    log_determinant,
    project,
    project_columns,
    surprise,
)
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import cholesky, copy_matrix, wrap
from groundstation.estimation.motion import clear, join
from groundstation.estimation.relative_pose import add_mounting_noise, pose_from_observation, relative_pose


@kernel("int64(float64[::1], int64, int64, float64[::1], float64[:,::1])")
def unpack(event: Array, offset: int, rows: int, z: Array, R: Array) -> int:
    """Write z and R of the hypothesis at an offset of the event; returns PENDING, or what is wrong with it."""
    factor = np.empty((4, 4))
    for i in range(4):
        z[i] = event[offset + i]
        for j in range(4):
            R[i, j] = 0.5 * (event[offset + 4 + 4 * i + j] + event[offset + 4 + 4 * j + i])
            factor[i, j] = R[i, j]
    if not cholesky(factor, rows):
        return s.SINGULAR
    if z[2] <= 0.0:
        return s.OUT_OF_VIEW
    return s.PENDING


@kernel(
    "float64(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[::1], float64[::1], int64,"
    " float64[::1], float64[:,::1], float64[:,:,::1], float64[::1])"
)
def linearise(
    mean: Array,
    P: Array,
    entities: IntArray,
    parameters: Array,
    camera: Array,
    event: Array,
    rows: int,
    z: Array,
    R: Array,
    work: Array,
    y: Array,
) -> float:
    """Write y = z - h(x) and, into work, H of both blocks, H P H^T and the factor of S; returns the NIS or -1."""
    observer, subject = int(event[s.EVENT_OBSERVER]), int(event[s.EVENT_SUBJECT])
    start = entities[subject, s.ENTITY_START]
    size = entities[subject, s.ENTITY_SIZE]
    start_o, size_o = entities[observer, s.ENTITY_START], entities[observer, s.ENTITY_SIZE]
    h = np.zeros(4)
    relative_pose(
        mean[start_o : start_o + size_o],
        mean[start : start + size],
        parameters[subject],
        entities[subject, s.ENTITY_MODEL],
        camera,
        event[s.EVENT_ROLL],
        event[s.EVENT_PITCH],
        rows,
        h,
        work[0],
        work[1],
    )
    for i in range(rows):
        y[i] = z[i] - h[i]
    if rows == 4:
        y[3] = wrap(y[3])
    W = np.empty((rows, P.shape[0]))
    HPH = np.empty((rows, rows))
    project(P, start_o, size_o, work[0], start, size, work[1], rows, W)
    project_columns(W, start_o, size_o, work[0], start, size, work[1], rows, HPH)
    for i in range(rows):
        for j in range(rows):
            work[2, i, j] = HPH[i, j]
    bound_precision(work[2], R, rows)
    return surprise(work[2], R, y, rows, work[3])


@kernel(
    "void(float64[::1], float64[:,::1], int64[:,::1], float64[::1], int64, float64[:,::1], float64[:,:,::1],"
    " float64[::1], float64)"
)
def correct(
    mean: Array, P: Array, entities: IntArray, event: Array, rows: int, R: Array, work: Array, y: Array, factor: float
) -> None:
    """Apply what `linearise` prepared, with S inflated by a factor >= 1; wraps all headings."""
    observer, subject = int(event[s.EVENT_OBSERVER]), int(event[s.EVENT_SUBJECT])
    start, size = entities[subject, s.ENTITY_START], entities[subject, s.ENTITY_SIZE]
    start_o, size_o = entities[observer, s.ENTITY_START], entities[observer, s.ENTITY_SIZE]
    if factor > 1.0:
        inflate(work[2], R, rows, factor)
        surprise(work[2], R, y, rows, work[3])
    W = np.empty((rows, P.shape[0]))
    project(P, start_o, size_o, work[0], start, size, work[1], rows, W)
    apply(mean, P, start_o, size_o, work[0], start, size, work[1], rows, W, work[3], R, y)
    for e in range(entities.shape[0]):
        if entities[e, s.ENTITY_MODEL] == s.ODOMETRY_ROBOT:
            yaw = entities[e, s.ENTITY_START] + s.YAW
            mean[yaw] = wrap(mean[yaw])


@kernel("void(float64[::1], float64, int64, float64[::1], float64[:,:,::1])")
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


@kernel("int64(int64[:,::1], float64[:,::1], float64[::1])")
def refusal(entities: IntArray, aux: Array, event: Array) -> int:
    """Return why an observation cannot be used whatever it says, or PENDING."""
    observer, subject = int(event[s.EVENT_OBSERVER]), int(event[s.EVENT_SUBJECT])
    if aux[observer, s.ACTIVE] == 0.0:
        return s.OBSERVER_UNKNOWN
    is_robot = entities[subject, s.ENTITY_MODEL] == s.ODOMETRY_ROBOT
    if is_robot and aux[subject, s.AIRBORNE] == 0.0:
        return s.SUBJECT_GROUNDED
    if is_robot and aux[subject, s.ACTIVE] == 0.0 and event[s.EVENT_SIZE] < 4.0:
        return s.YAW_MISSING
    return s.PENDING


@kernel("boolean(float64[::1], float64[::1], float64, float64)")
def has_diverged(aux: Array, settings: Array, at: float, nis_over_gate: float) -> bool:
    """Count wild innovations in a row of one entity; True when they last long enough to blame the belief."""
    if nis_over_gate <= settings[s.SETTING_WILD]:
        if nis_over_gate <= 1.0:
            aux[s.STREAK] = 0.0
        return False
    if aux[s.STREAK] == 0.0:
        aux[s.STREAK_START] = at
    aux[s.STREAK] += 1.0
    lasting = at - aux[s.STREAK_START] >= settings[s.SETTING_STREAK_S]
    return bool(lasting and aux[s.STREAK] >= settings[s.SETTING_STREAK])


@kernel(
    "float64(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[::1], float64[::1], int64,"
    " float64[::1], float64[:,::1], float64[:,:,::1], float64[::1], float64, float64[::1])"
)
def prefer_other(
    mean: Array,
    P: Array,
    entities: IntArray,
    parameters: Array,
    camera: Array,
    event: Array,
    rows: int,
    z: Array,
    R: Array,
    work: Array,
    y: Array,
    nis: float,
    out: Array,
) -> float:
    """Switch z, R, y and work to the alternative pose if the belief finds it more likely; returns the NIS in force."""
    if event[s.EVENT_HAS_OTHER] == 0.0 or nis < 0.0:
        return nis
    z_other, R_other, y_other, work_other = np.zeros(4), np.zeros((4, 4)), np.zeros(4), np.zeros((4, 4, s.MAX_BLOCK))
    if unpack(event, s.EVENT_OTHER, rows, z_other, R_other) != s.PENDING:
        return nis
    add_mounting_noise(camera, z_other, rows, R_other)
    nis_other = linearise(mean, P, entities, parameters, camera, event, rows, z_other, R_other, work_other, y_other)
    if nis_other < 0.0:
        return nis
    if nis_other + log_determinant(work_other[3], rows) >= nis + log_determinant(work[3], rows):
        return nis
    for i in range(4):
        z[i], y[i] = z_other[i], y_other[i]
        copy_matrix(R_other, R)
        copy_matrix(work_other[i], work[i])
    out[s.OUT_OTHER_CHOSEN] = 1.0
    return nis_other


@kernel(
    "void(float64[::1], float64[:,::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[::1],"
    " float64[::1], float64[::1])"
)
def enter(
    mean: Array, P: Array, aux: Array, entities: IntArray, parameters: Array, camera: Array, event: Array, z: Array
) -> None:
    """Let the subject join (again) where the measurement puts it, diffuse until the correction that follows."""
    observer, subject = int(event[s.EVENT_OBSERVER]), int(event[s.EVENT_SUBJECT])
    start = entities[observer, s.ENTITY_START]
    seen_from, pose = mean[start : start + entities[observer, s.ENTITY_SIZE]], np.zeros(4)
    model, p = entities[subject, s.ENTITY_MODEL], parameters[subject]
    pose_from_observation(seen_from, p, model, camera, event[s.EVENT_ROLL], event[s.EVENT_PITCH], z, pose)
    join(mean, P, entities[subject], p, pose)
    aux[subject, s.ACTIVE] = 1.0
    aux[subject, s.JOINED_AT] = event[s.EVENT_AT]
    aux[subject, s.STREAK] = 0.0


@kernel(
    "void(float64[::1], float64[:,::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1],"
    " float64[::1], float64[::1], float64[::1])"
)
def observe(
    mean: Array,
    P: Array,
    aux: Array,
    entities: IntArray,
    parameters: Array,
    cameras: Array,
    settings: Array,
    event: Array,
    out: Array,
) -> None:
    """Correct by one observation, or say why not: gate, choice of hypothesis, joining, re-initialisation."""
    subject = int(event[s.EVENT_SUBJECT])
    camera = cameras[int(event[s.EVENT_CAMERA])]
    rows = int(event[s.EVENT_SIZE])
    if entities[subject, s.ENTITY_MODEL] != s.ODOMETRY_ROBOT:
        rows = 3
    z, y, R, work = np.zeros(4), np.zeros(4), np.zeros((4, 4)), np.zeros((4, 4, s.MAX_BLOCK))
    verdict = refusal(entities, aux, event)
    if verdict == s.PENDING:
        verdict = unpack(event, s.EVENT_Z, rows, z, R)
    out[s.OUT_VERDICT] = verdict
    out[s.OUT_JOINED] = 0.0
    out[s.OUT_OTHER_CHOSEN] = 0.0
    if verdict != s.PENDING:
        return
    add_mounting_noise(camera, z, rows, R)
    gate = settings[s.SETTING_GATE + rows]
    at, joined = event[s.EVENT_AT], aux[subject, s.ACTIVE] == 0.0
    excess = 1.0
    if not joined:
        nis = linearise(mean, P, entities, parameters, camera, event, rows, z, R, work, y)
        nis = prefer_other(mean, P, entities, parameters, camera, event, rows, z, R, work, y, nis, out)
        write_outcome(out, nis, rows, y, work)
        if nis < 0.0:
            out[s.OUT_VERDICT] = s.SINGULAR
            return
        excess = nis / gate
        joined = has_diverged(aux[subject], settings, at, excess)
        if excess > settings[s.SETTING_WILD] and not joined:
            out[s.OUT_VERDICT] = s.IMPLAUSIBLE
            return
    if joined:
        enter(mean, P, aux, entities, parameters, camera, event, z)
        linearise(mean, P, entities, parameters, camera, event, rows, z, R, work, y)
        excess = 1.0
        out[s.OUT_JOINED] = 1.0
    correct(mean, P, entities, event, rows, R, work, y, max(excess, 1.0))
    aux[subject, s.CORRECTED_AT] = at
    out[s.OUT_VERDICT] = s.INFLATED if excess > 1.0 else s.ACCEPTED


@kernel(
    "void(float64[::1], float64[:,::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1],"
    " float64[::1], float64[::1], float64[::1])"
)
def handle(
    mean: Array,
    P: Array,
    aux: Array,
    entities: IntArray,
    parameters: Array,
    cameras: Array,
    settings: Array,
    event: Array,
    out: Array,
) -> None:
    """Do what one event asks for and write what became of it."""
    kind, subject = int(event[s.EVENT_KIND]), int(event[s.EVENT_SUBJECT])
    if kind == s.KIND_OBSERVATION:
        observe(mean, P, aux, entities, parameters, cameras, settings, event, out)
        return
    out[s.OUT_VERDICT] = s.ACCEPTED
    if kind == s.KIND_AIRBORNE:
        aux[subject, s.AIRBORNE] = 1.0
        return
    aux[subject, s.AIRBORNE] = 0.0
    aux[subject, s.ACTIVE] = 0.0
    clear(mean, P, entities[subject])

"""The exact rewind: from a checkpoint through odometry and events in order of time, in one compiled call."""

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.correction import correct_sum
from groundstation.estimation.events import handle
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import copy_matrix, wrap
from groundstation.estimation.motion import predict


@kernel("void(float64[::1], float64[::1], float64[::1], float64)")
def take_odometry(condensed: Array, aux: Array, p: Array, step: float) -> None:
    """Turn one step's condensed odometry into the velocity and yaw rate held during that step."""
    aux[s.YAW_RATE] = 0.0
    aux[s.ODOMETRY_AGE] += step
    count = condensed[s.VELOCITY_COUNT]
    if count > 0.0:
        aux[s.HELD_VX] = condensed[s.SUM_VX] / count
        aux[s.HELD_VY] = condensed[s.SUM_VY] / count
        aux[s.HELD_VZ] = condensed[s.SUM_VZ] / count
        aux[s.ODOMETRY_AGE] = 0.0
    elif aux[s.ODOMETRY_AGE] > p[s.HOLD_S]:
        aux[s.HELD_VX] = aux[s.HELD_VY] = aux[s.HELD_VZ] = 0.0
    if condensed[s.NEWEST_AT] < 0.0:
        return
    # An increment across a reset is void: the vehicle's own heading jumped, the vehicle did not.
    if aux[s.HAS_YAW] != 0.0 and aux[s.LAST_RESET] == condensed[s.NEWEST_RESET]:
        aux[s.YAW_RATE] = wrap(condensed[s.NEWEST_YAW] - aux[s.LAST_YAW]) / step
    aux[s.LAST_YAW], aux[s.LAST_RESET], aux[s.HAS_YAW] = condensed[s.NEWEST_YAW], condensed[s.NEWEST_RESET], 1.0


@kernel(
    "void(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[::1])"
)
def begin_step(
    mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, condensed: Array, settings: Array
) -> None:
    """Take the odometry of a step for all robots and correct by their heights."""
    for e in range(entities.shape[0]):
        if entities[e, s.ENTITY_MODEL] != s.ODOMETRY_ROBOT:
            continue
        take_odometry(condensed[e], aux[e], parameters[e], settings[s.SETTING_STEP])
        if aux[e, s.ACTIVE] != 0.0 and condensed[e, s.HEIGHT_COUNT] > 0.0:
            height = condensed[e, s.HEIGHT_SUM] / condensed[e, s.HEIGHT_COUNT]
            start = entities[e, s.ENTITY_START]
            gate, variance = settings[s.SETTING_GATE + 1], parameters[e, s.HEIGHT_VARIANCE]
            correct_sum(mean, P, start + s.Z, start + s.HEIGHT_ERROR, height, variance, gate)


@kernel(
    "void(int64[:,::1], float64[:,::1], float64[:,::1], float64[::1],"
    " float64[:,::1], float64[:,:,::1], float64[:,:,::1], float64[:,:,::1],"
    " float64[:,::1], int64[::1], float64[:,::1], int64, int64, float64,"
    " float64[::1], float64[:,::1], float64[:,::1])"
)
def replay(
    entities: IntArray,
    parameters: Array,
    cameras: Array,
    settings: Array,
    means: Array,
    covariances: Array,
    auxiliaries: Array,
    odometry: Array,
    events: Array,
    order: IntArray,
    outcomes: Array,
    first: int,
    last: int,
    now: float,
    mean: Array,
    P: Array,
    aux: Array,
) -> None:
    """Run steps first..last from the checkpoint of step `first`, renewing checkpoints; leaves the belief at `now`.

    Checkpoint k is the state at time k * step before anything of step k; rings are indexed modulo their length.
    `order` lists rows of `events` by time, none before step `first`.
    """
    ring = means.shape[0]
    step = settings[s.SETTING_STEP]
    for j in range(mean.shape[0]):
        mean[j] = means[first % ring, j]
    copy_matrix(covariances[first % ring], P)
    copy_matrix(auxiliaries[first % ring], aux)
    i = 0
    for k in range(first, last + 1):
        slot = k % ring
        if k > first:
            for j in range(mean.shape[0]):
                means[slot, j] = mean[j]
            copy_matrix(P, covariances[slot])
            copy_matrix(aux, auxiliaries[slot])
        begin_step(mean, P, entities, parameters, aux, odometry[slot], settings)
        t = k * step
        end = min((k + 1) * step, max(now, t))
        while i < order.shape[0] and events[order[i], s.EVENT_STEP] == k and events[order[i], s.EVENT_AT] <= now:
            row = order[i]
            at = min(max(events[row, s.EVENT_AT], t), end)
            if at > t:
                predict(mean, P, entities, parameters, aux, at - t)
                t = at
            handle(mean, P, aux, entities, parameters, cameras, settings, events[row], outcomes[row])
            i += 1
        if end > t:
            predict(mean, P, entities, parameters, aux, end - t)

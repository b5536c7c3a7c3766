"""The exact rewind: from a checkpoint through odometry and events in order of time, in one compiled call."""

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.dispatch import call_begin, call_handle
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.modes import combine, mix
from groundstation.estimation.motion import predict


@kernel(
    "void(float64[:,::1], float64[:,:,::1], int64[:,:,::1], float64[:,:,::1], float64[:,::1], float64[:,::1],"
    " float64[::1])"
)
def begin_step(
    means: Array, covariances: Array, entities: IntArray, parameters: Array, aux: Array, odometry: Array,
    settings: Array,
) -> None:  # fmt: skip
    """Let all entities that are driven take the odometry of a step: inputs once, heights in every mode."""
    step, gate = settings[s.SETTING_STEP], settings[s.SETTING_GATE + 1]
    before = aux.copy()
    for m in range(means.shape[0]):
        if m > 0:
            copy_matrix(before, aux)
        for e in range(entities.shape[1]):
            if entities[m, e, s.ENTITY_BEGIN] != 0:
                arguments = (means[m], covariances[m], entities[m], parameters[m], aux, odometry, e, step, gate)
                call_begin(entities[m, e, s.ENTITY_BEGIN], arguments)


@kernel(
    "void(float64[:,::1], float64[:,:,::1], float64[::1], float64[:,::1], float64[:,::1],"
    " float64[:,::1], float64[:,:,::1], float64[::1], float64[:,::1], float64[:,::1])"
)
def copy_state(
    means: Array, covariances: Array, weights: Array, aux: Array, pairs: Array,
    to_means: Array, to_covariances: Array, to_weights: Array, to_aux: Array, to_pairs: Array,
) -> None:  # fmt: skip
    """Copy all that a checkpoint holds."""
    copy_matrix(means, to_means)
    for m in range(weights.shape[0]):
        copy_matrix(covariances[m], to_covariances[m])
        to_weights[m] = weights[m]
    copy_matrix(aux, to_aux)
    copy_matrix(pairs, to_pairs)


@kernel(
    "void(int64[::1], int64[:,:,::1], float64[:,:,::1], float64[:,:,::1], int64[:,::1], float64[:,::1], float64[::1],"
    " float64[:,::1], float64[:,:,::1], float64[:,:,:,::1], float64[:,::1], float64[:,:,::1], float64[:,:,::1],"
    " float64[:,:,::1], float64[:,::1], int64[::1], float64[:,::1], int64, int64, float64,"
    " float64[:,::1], float64[:,:,::1], float64[::1], float64[:,::1], float64[:,::1], float64[::1], float64[:,::1])"
)
def replay(
    event_kernels: IntArray, entities: IntArray, parameters: Array, priors: Array, kernels: IntArray, sensors: Array,
    settings: Array, transition: Array, ring_means: Array, ring_covariances: Array, ring_weights: Array,
    ring_aux: Array, ring_pairs: Array, odometry: Array, events: Array, order: IntArray, outcomes: Array, first: int,
    last: int, now: float, means: Array, covariances: Array, weights: Array, aux: Array, pairs: Array, mean: Array,
    P: Array,
) -> None:  # fmt: skip
    """Run steps first..last from the checkpoint of step `first`, renewing checkpoints; leaves the belief at `now`.

    Checkpoint k is the state at time k * step before anything of step k; rings are indexed modulo their length.
    `order` lists rows of `events` by time, none before step `first`; event_kernels: addresses by kind of event.
    """
    ring, step = ring_means.shape[0], settings[s.SETTING_STEP]
    slot = first % ring
    copy_state(
        ring_means[slot], ring_covariances[slot], ring_weights[slot], ring_aux[slot], ring_pairs[slot],
        means, covariances, weights, aux, pairs,
    )  # fmt: skip
    i = 0
    for k in range(first, last + 1):
        slot = k % ring
        if k > first:
            copy_state(
                means, covariances, weights, aux, pairs,
                ring_means[slot], ring_covariances[slot], ring_weights[slot], ring_aux[slot], ring_pairs[slot],
            )  # fmt: skip
        mix(means, covariances, weights, transition, entities[0])
        begin_step(means, covariances, entities, parameters, aux, odometry[slot], settings)
        t = k * step
        end = min((k + 1) * step, max(now, t))
        while i < order.shape[0] and events[order[i], s.EVENT_STEP] == k and events[order[i], s.EVENT_AT] <= now:
            row = order[i]
            at = min(max(events[row, s.EVENT_AT], t), end)
            if at > t:
                for m in range(weights.shape[0]):
                    predict(means[m], covariances[m], entities[m], parameters[m], aux, at - t)
                t = at
            arguments = (
                means, covariances, weights, aux, entities, parameters, priors, kernels, sensors, pairs, settings,
                events[row], outcomes[row],
            )  # fmt: skip
            call_handle(event_kernels[int(events[row, s.EVENT_KIND])], arguments)
            i += 1
        if end > t:
            for m in range(weights.shape[0]):
                predict(means[m], covariances[m], entities[m], parameters[m], aux, end - t)
    combine(means, covariances, weights, entities[0], mean, P)

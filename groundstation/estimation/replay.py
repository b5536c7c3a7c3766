"""The exact rewind: from a checkpoint through odometry and events in order of time, in one compiled call."""

import numpy as np

from groundstation.arrays import IntVector
from groundstation.estimation.ahead import is_reading, predict_ahead, quiet_from
from groundstation.estimation.deferred import make_all
from groundstation.estimation.filter_state import (
    Checkpoints,
    Inputs,
    Moments,
    Span,
    State,
    Tables,
    belief_of,
    deferred_of,
)
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.model_kernels import call_begin, call_handle
from groundstation.estimation.modes import combine, mix
from groundstation.estimation.motion import predict
from groundstation.estimation.records import CondensedOdometry, EntityMemory
from groundstation.estimation.register_blocks import copy_upper_blocks, reflect
from groundstation.kernel import Rows, copy_rows, kernel

_MEMORY = EntityMemory.dtype


@kernel()
def begin_step(state: State, tables: Tables, odometry: Rows[CondensedOdometry]) -> None:
    """Apply a step's odometry to all driven entities: inputs once, heights in every mode."""
    step_s, gate = tables.settings.step_s, tables.settings.gates[1]
    before = np.empty(state.memory.shape[0], _MEMORY)
    copy_rows(state.memory, before)
    for m in range(state.means.shape[0]):
        if m > 0:
            copy_rows(before, state.memory)
        belief, deferred = belief_of(state, tables, m), deferred_of(state, m)
        for e in range(belief.entities.shape[0]):
            if belief.entities[e].begin != 0:
                call_begin(belief.entities[e].begin, (belief, deferred, odometry[e], e, step_s, gate))


@kernel()
def copy_state(source: State, to: State) -> None:
    """Copy the contents of a checkpoint: of the covariances, which are exactly symmetric, only the upper halves."""
    copy_matrix(source.means, to.means)
    for m in range(source.weights.shape[0]):
        copy_upper_blocks(source.covariances[m], to.covariances[m])
        to.weights[m] = source.weights[m]
    copy_rows(source.memory, to.memory)
    copy_matrix(source.used_at, to.used_at)


@kernel(inlined=True)
def checkpoint(ring: Checkpoints, step: int, state: State) -> State:
    """Return the state at the beginning of a step, by reference; like `state` it has no deferred corrections."""
    k = step % ring.means.shape[0]
    means, covariances, weights, memory = ring.means[k], ring.covariances[k], ring.weights[k], ring.memory[k]
    return State(means, covariances, weights, memory, ring.used_at[k], state.deferred, state.deferred_used)


@kernel(inlined=True)
def predict_modes(state: State, tables: Tables, dt: float) -> None:
    """Predict all modes, after the deferred corrections."""
    make_all(state)
    for m in range(state.weights.shape[0]):
        predict(belief_of(state, tables, m), dt)


@kernel()
def replay(
    event_kernels: IntVector, tables: Tables, ring: Checkpoints, inputs: Inputs, span: Span, state: State, out: Moments
) -> None:
    """Run the steps of a span from the checkpoint of the first, renewing checkpoints; leaves the belief at its end.

    Checkpoint k is the state at time k * step_s before anything of step k; rings are indexed modulo their length. No
    event in `inputs.order` is before the first step; event_kernels: addresses by kind of event. Steps from the first
    one whose observations wait are only predicted, and have no checkpoints.
    """
    step_s, order, events = tables.settings.step_s, inputs.order, inputs.events
    copy_state(checkpoint(ring, span.first, state), state)
    for m in range(state.covariances.shape[0]):
        reflect(state.covariances[m])
    i, quiet = 0, quiet_from(inputs, span, state.means.shape[0])
    for k in range(span.first, span.last + 1):
        if span.first < k <= span.waiting:
            copy_state(state, checkpoint(ring, k, state))
        if k == quiet:
            predict_ahead(state, tables, inputs, span, k)
            break
        mix(state, tables)
        begin_step(state, tables, inputs.odometry[k % ring.means.shape[0]])
        t = k * step_s
        end = min((k + 1) * step_s, max(span.now, t))
        while i < order.shape[0] and events[order[i]].step == k and events[order[i]].at <= span.now:
            row = order[i]
            i += 1
            if k >= span.waiting and is_reading(events[row]):
                continue
            at = min(max(events[row].at, t), end)
            if at > t:
                predict_modes(state, tables, at - t)
                t = at
            call_handle(event_kernels[events[row].kind], (state, tables, events[row], inputs.outcomes[row]))
        if end > t:
            predict_modes(state, tables, end - t)
        make_all(state)
    combine(state, tables, out)

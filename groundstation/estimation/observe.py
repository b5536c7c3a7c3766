"""Executes one event at its measurement time: an observation, or a change of the entities in the state; compiled.

There is one belief per mode (modes.py). Gate, hypothesis and joining are decided for all modes together.
"""

import math

import numpy as np

from groundstation.estimation.deferred import make_all, variance_of
from groundstation.estimation.evidence import confront, likeliest, set_noise, weigh
from groundstation.estimation.filter_state import Belief, Deferred, Hypothesis, State, Tables, belief_of, deferred_of
from groundstation.estimation.joining import admit
from groundstation.estimation.motion import clear, enter, join
from groundstation.estimation.outliers import forget_noted_error, note_given_up
from groundstation.estimation.records import (
    ACCEPTED,
    ADMITTED,
    CONTRADICTED,
    DISMISSED,
    INFLATED,
    KIND_ROBOT,
    KIND_TARGET,
    MAX_ROWS,
    OBSERVER_UNCONFIRMED,
    OBSERVER_UNKNOWN,
    PENDING,
    PLACED,
    POSE,
    SUBJECT_GROUNDED,
    TURNED,
    YAW_MISSING,
    EventRow,
    Innovation,
    OutcomeRow,
    PriorRow,
    X,
    Y,
)
from groundstation.estimation.update import correct, note_motion, read, write_outcome
from groundstation.estimation.verdict import Tested, confirm
from groundstation.estimation.witnessed import correct_all_but_velocities, is_unwitnessed, note_witness
from groundstation.kernel import kernel

_INNOVATION = Innovation.dtype


@kernel(inlined=True)
def refusal(belief: Belief, event: EventRow, rows: int) -> int:
    """Return why an observation cannot be used, independent of its values, or PENDING."""
    observer, subject = belief.memory[event.observer], belief.memory[event.subject]
    if observer.active == 0:
        return OBSERVER_UNKNOWN
    if observer.unconfirmed != 0:
        return OBSERVER_UNCONFIRMED
    if subject.admitted == 0:
        return SUBJECT_GROUNDED
    if subject.active == 0 and belief.entities[event.subject].kind == KIND_ROBOT and rows < 4:
        return YAW_MISSING
    return PENDING


@kernel(inlined=True)
def choose(
    state: State, tables: Tables, event: EventRow, rows: int, unused_s: float, measured: Hypothesis, other: Hypothesis
) -> bool:
    """Confront the belief with the pose as measured and, if there is one, its alternative; True if that is likelier."""
    evidence = confront(state, tables, event, rows, measured)
    if event.has_alternative == 0 or evidence == -math.inf:
        return False
    belief, sensor = belief_of(state, tables, 0), tables.sensors[event.sensor]
    if read(belief, sensor, event, event.alternative, unused_s, other.z, other.R) != rows:
        return False
    set_noise(other.innovations, other.R)
    return confront(state, tables, event, rows, other) > evidence


@kernel(inlined=True)
def correct_modes(state: State, tables: Tables, event: EventRow, used: Hypothesis, excess: float) -> None:
    """Correct all modes that can use the observation, with S raised by `excess`."""
    teaches = not is_unwitnessed(belief_of(state, tables, 0), event)
    for m in range(state.means.shape[0]):
        if used.innovations[m].nis >= 0.0:
            belief, deferred = belief_of(state, tables, m), deferred_of(state, m)
            if teaches:
                correct(belief, deferred, tables.headings, used.innovations[m], used.HP[m], excess)
            else:
                correct_all_but_velocities(belief, deferred, tables.headings, used.innovations[m], used.HP[m], excess)


@kernel(inlined=True)
def note_place(belief: Belief, deferred: Deferred, e: int) -> None:
    """Note the variance of a robot's or target's place right after an observation of it."""
    entity = belief.entities[e]
    if entity.kind == KIND_ROBOT or entity.kind == KIND_TARGET:
        x, y = entity.start + X, entity.start + Y
        variance = max(variance_of(belief.P, deferred, x), variance_of(belief.P, deferred, y))
        belief.memory[e].seen_variance = variance


@kernel(inlined=True)
def note_use(state: State, first: Belief, event: EventRow) -> None:
    """Note that the subject was corrected by the event."""
    subject = state.memory[event.subject]
    forget_noted_error(subject, event.at)
    note_place(first, deferred_of(state, 0), event.subject)
    note_witness(first, event)
    subject.corrected_at = state.used_at[event.sensor, event.subject] = event.at


@kernel()
def let_join(state: State, tables: Tables, event: EventRow, rows: int, used: Hypothesis, out: OutcomeRow) -> bool:
    """Let the subject join by an observation, or give up its belief for it; False if it may not yet."""
    subject, kind = state.memory[event.subject], tables.entities[0, event.subject].kind
    fresh, confirmed = subject.active == 0, subject.unconfirmed == 0
    make_all(state)
    out.verdict = admit(state, tables, event, rows, used)
    if fresh and out.verdict == CONTRADICTED:
        write_outcome(out, used.innovations[likeliest(state.weights, used.innovations)])
    if out.verdict != ACCEPTED and out.verdict != INFLATED:
        return False
    if not fresh and confirmed and kind == KIND_ROBOT:
        note_given_up(state.memory[event.observer], event.subject, event.at)
    out.joined = 1
    return True


@kernel()
def observe(state: State, tables: Tables, event: EventRow, out: OutcomeRow) -> None:
    """Correct by one observation, or record why not: gate, choice of hypothesis, joining, re-initialisation."""
    modes, sensor, first = state.means.shape[0], tables.sensors[event.sensor], belief_of(state, tables, 0)
    # First axis: the pose as measured, and its alternative.
    z, R, HP = np.zeros((2, MAX_ROWS)), np.zeros((2, MAX_ROWS, MAX_ROWS)), np.empty((2, modes, 4, state.means.shape[1]))
    innovations = np.zeros((2, modes), _INNOVATION)
    used, other = Hypothesis(z[0], R[0], innovations[0], HP[0]), Hypothesis(z[1], R[1], innovations[1], HP[1])
    unused_s = event.at - state.used_at[event.sensor, event.subject]
    note_motion(first, event)
    out.joined, out.alternative_chosen, out.ahead_x, out.ahead_y = 0, 0, 0.0, 0.0
    rows = read(first, sensor, event, event.measured, unused_s, used.z, used.R)
    out.verdict = -rows if rows < 0 else refusal(first, event, rows)
    if out.verdict != PENDING:
        return
    set_noise(used.innovations, used.R)
    tested = Tested(rows, 1.0, False, True)
    if state.memory[event.subject].active != 0:
        if choose(state, tables, event, rows, unused_s, used, other):
            used, out.alternative_chosen = other, 1
        tested = confirm(state, tables, event, rows, used, out)
    if out.verdict == PENDING:
        out.verdict = INFLATED if tested.excess > 1.0 or tested.placed else ACCEPTED
    elif out.verdict != TURNED:
        return
    excess = tested.excess
    if tested.joins:
        if not let_join(state, tables, event, rows, used, out):
            return
        excess = 1.0
    correct_modes(state, tables, event, used, excess)
    if tested.joins:
        make_all(state)  # a diffuse prior is too wide for deferred corrections beside it
    weigh(state.weights, used.innovations, tested.rows, excess)
    note_use(state, first, event)


@kernel()
def place(belief: Belief, e: int, prior: PriorRow, event: EventRow) -> None:
    """Put an entity at the event's pose (x, y, z, yaw) with its covariance, independent of all others."""
    index, pose, entity = np.empty(POSE, np.int64), np.empty(POSE), belief.entities[e]
    for i in range(POSE):
        pose[i] = event.measured.z[i]
    join(belief, e, prior, pose)
    at = (X, Y, entity.at_z, entity.at_yaw)
    for i in range(POSE):
        index[i] = entity.start + at[i] if at[i] >= 0 else -1
    for i in range(POSE):
        for j in range(POSE):
            if index[i] >= 0 and index[j] >= 0:
                belief.P[index[i], index[j]] = event.measured.R[i, j]


@kernel()
def change(state: State, tables: Tables, event: EventRow, out: OutcomeRow) -> None:
    """Let an entity join or leave, or place it."""
    make_all(state)
    kind, memory, prior = event.kind, state.memory[event.subject], tables.priors[event.subject]
    out.verdict = ACCEPTED
    known = memory.active != 0
    enters = kind == PLACED or (kind == ADMITTED and tables.entities[0, event.subject].present != 0)
    memory.admitted = 0 if kind == DISMISSED else 1
    for m in range(state.means.shape[0]):
        belief = belief_of(state, tables, m)
        if kind == DISMISSED:
            clear(belief, event.subject)
        elif kind == PLACED:
            place(belief, event.subject, prior, event)
        elif enters and not known:
            enter(belief, event.subject, prior)
    if kind == DISMISSED:
        memory.active = memory.refused.count = 0
        memory.noted_error = memory.slow_vx = memory.slow_vy = 0.0
    elif enters:
        memory.active = 1
        memory.wild.count = memory.astray.count = memory.refused.count = memory.unconfirmed = 0
        memory.corrected_at = event.at
        note_place(belief_of(state, tables, 0), deferred_of(state, 0), event.subject)

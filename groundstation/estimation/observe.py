"""Executes one event at its measurement time: an observation, or a change of the entities in the state; compiled.

There is one belief per mode (modes.py). Gate, hypothesis and joining are decided for all modes together.
"""

import math

import numpy as np

from groundstation.estimation.deferred import make_all, variance_of
from groundstation.estimation.evidence import confront, least_nis, likeliest, set_noise, weigh
from groundstation.estimation.filter_state import Belief, Deferred, Hypothesis, State, Tables, belief_of, deferred_of
from groundstation.estimation.joining import admit
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.lost_observer import answers_for, approach, face, loosen, note_move
from groundstation.estimation.motion import clear, enter, join
from groundstation.estimation.outliers import agree, blame, doubt_velocity, forget_noted_error, note_given_up
from groundstation.estimation.records import (
    ACCEPTED,
    ADMITTED,
    CONTRADICTED,
    DISMISSED,
    INFLATED,
    KIND_CAMERA,
    KIND_ROBOT,
    KIND_TARGET,
    MAX_ROWS,
    OBSERVER_UNCONFIRMED,
    OBSERVER_UNKNOWN,
    PENDING,
    PLACED,
    POSE,
    SINGULAR,
    SUBJECT_GROUNDED,
    TURNED,
    YAW,
    YAW_MISSING,
    EventRow,
    Innovation,
    OutcomeRow,
    PriorRow,
    X,
    Y,
)
from groundstation.estimation.update import correct, note_motion, read, write_ahead, write_outcome
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


@kernel()
def confront_place(state: State, tables: Tables, event: EventRow, hypothesis: Hypothesis) -> float:
    """Confront the belief with a sighting's place without its heading; returns its excess over the gate, at least 1."""
    set_noise(hypothesis.innovations, hypothesis.R)
    confront(state, tables, event, YAW, hypothesis)
    excess: float = least_nis(hypothesis.innovations) / tables.settings.gates[YAW]
    return max(excess, 1.0)


@kernel()
def face_subject(
    state: State, tables: Tables, event: EventRow, rows: int, hypothesis: Hypothesis, insists: bool
) -> None:  # fmt: skip
    """Let an observer of unknown heading face what it reads, in all modes, and confront it anew."""
    turned, sensor = False, tables.sensors[event.sensor]
    for m in range(state.means.shape[0]):
        belief, innovation = belief_of(state, tables, m), hypothesis.innovations[m]
        if innovation.nis >= 0.0:
            turned = face(belief, deferred_of(state, m), sensor, event, innovation, insists) or turned
    if turned:
        set_noise(hypothesis.innovations, hypothesis.R)
        confront(state, tables, event, rows, hypothesis)


@kernel()
def place_observer(state: State, tables: Tables, event: EventRow, rows: int, hypothesis: Hypothesis) -> float:
    """Place the observer of a landmark by its reading, in all modes; returns the excess over the gate, at least 1.

    What then remains beyond the gate loosens its belief. No correction is deferred when it is called.
    """
    gate, means = tables.settings.gates[rows], state.means.copy()
    face_subject(state, tables, event, rows, hypothesis, True)
    for m in range(means.shape[0]):
        belief = belief_of(state, tables, m)
        approach(belief, tables.sensors[event.sensor], event, hypothesis.z)
        note_move(belief, event.observer, means[m])
    set_noise(hypothesis.innovations, hypothesis.R)
    confront(state, tables, event, rows, hypothesis)
    for m in range(means.shape[0]):
        if hypothesis.innovations[m].nis > gate:
            loosen(belief_of(state, tables, m), event, hypothesis.innovations[m], gate)
    set_noise(hypothesis.innovations, hypothesis.R)
    confront(state, tables, event, rows, hypothesis)
    excess: float = least_nis(hypothesis.innovations) / gate
    return max(excess, 1.0)


@kernel(inlined=True)
def correct_modes(state: State, tables: Tables, used: Hypothesis, excess: float) -> None:
    """Correct all modes that can use the observation, with S raised by `excess`."""
    for m in range(state.means.shape[0]):
        if used.innovations[m].nis >= 0.0:
            belief, deferred = belief_of(state, tables, m), deferred_of(state, m)
            correct(belief, deferred, tables.headings, used.innovations[m], used.HP[m], excess)


@kernel(inlined=True)
def note_place(belief: Belief, deferred: Deferred, e: int) -> None:
    """Note the variance of a robot's or target's place right after an observation of it."""
    entity = belief.entities[e]
    if entity.kind == KIND_ROBOT or entity.kind == KIND_TARGET:
        x, y = entity.start + X, entity.start + Y
        variance = max(variance_of(belief.P, deferred, x), variance_of(belief.P, deferred, y))
        belief.memory[e].seen_variance = variance


@kernel(inlined=True)
def judge(belief: Belief, event: EventRow, rows: int, agrees: bool, joins: bool) -> None:
    """Note whether an observation agrees with the belief that it tests, or what its surprise makes doubtful."""
    answering = answers_for(belief, event)
    if agrees:
        agree(belief.memory[answering], event.at, rows)
    elif not joins and (answering != event.subject or belief.entities[event.observer].kind == KIND_CAMERA):
        doubt_velocity(belief.memory[answering])


@kernel(inlined=True)
def note_use(state: State, first: Belief, event: EventRow) -> None:
    """Note that the subject was corrected by the event."""
    subject = state.memory[event.subject]
    forget_noted_error(subject, event.at)
    note_place(first, deferred_of(state, 0), event.subject)
    subject.corrected_at = state.used_at[event.sensor, event.subject] = event.at


@kernel()
def observe(state: State, tables: Tables, event: EventRow, out: OutcomeRow) -> None:
    """Correct by one observation, or record why not: gate, choice of hypothesis, joining, re-initialisation."""
    modes, sensor, settings = state.means.shape[0], tables.sensors[event.sensor], tables.settings
    subject, first, believed = state.memory[event.subject], belief_of(state, tables, 0), state.means.copy()
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
    gate, fresh, excess, placed = settings.gates[rows], subject.active == 0, 1.0, False
    joins, confirmed = fresh, subject.unconfirmed == 0
    if not fresh:
        if choose(state, tables, event, rows, unused_s, used, other):
            used, out.alternative_chosen = other, 1
        face_subject(state, tables, event, rows, used, False)
        mode = likeliest(state.weights, used.innovations)
        if mode < 0:
            out.verdict = SINGULAR
            return
        write_outcome(out, used.innovations[mode])
        write_ahead(out, first.entities[event.subject], used.innovations[mode])
        excess = max(least_nis(used.innovations) / gate, 1.0)
        if excess > settings.wild_gates:
            make_all(state)
            out.verdict = blame(first, deferred_of(state, 0), sensor, settings, event, rows, used)
            if out.verdict == TURNED:
                rows, excess = YAW, confront_place(state, tables, event, used)
                write_outcome(out, used.innovations[mode])
            elif out.verdict != PENDING:
                copy_matrix(believed, state.means)
                return
            placed = answers_for(first, event) != event.subject
            joins = out.verdict == PENDING and not placed
            if placed:
                excess = place_observer(state, tables, event, rows, used)
        judge(first, event, rows, excess == 1.0 and not placed, joins)
    if out.verdict != TURNED:
        out.verdict = INFLATED if excess > 1.0 or placed else ACCEPTED
    if joins:
        make_all(state)
        out.verdict = admit(state, tables, event, rows, used)
        if fresh and out.verdict == CONTRADICTED:
            write_outcome(out, used.innovations[likeliest(state.weights, used.innovations)])
        if out.verdict != ACCEPTED and out.verdict != INFLATED:
            return
        if not fresh and confirmed and first.entities[event.subject].kind == KIND_ROBOT:
            note_given_up(state.memory[event.observer], event.subject, event.at)
        excess, out.joined = 1.0, 1
    correct_modes(state, tables, used, excess)
    if joins:
        make_all(state)  # a diffuse prior is too wide for deferred corrections beside it
    weigh(state.weights, used.innovations, rows, excess)
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

"""Decides how the belief takes an observation of a known entity: agreement, doubt, or who is to blame; compiled.

All modes decide together. `observe.py` corrects by what is left of the observation.
"""

from typing import NamedTuple

from groundstation.estimation.deferred import make_all
from groundstation.estimation.evidence import confront, least_nis, likeliest, set_noise
from groundstation.estimation.filter_state import Belief, Hypothesis, State, Tables, belief_of, deferred_of
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.lost_observer import answers_for, approach, face, loosen, note_move
from groundstation.estimation.outliers import agree, blame, doubt_velocity
from groundstation.estimation.records import KIND_CAMERA, PENDING, SINGULAR, TURNED, YAW, EventRow, OutcomeRow
from groundstation.estimation.update import write_ahead, write_outcome
from groundstation.kernel import kernel


class Tested(NamedTuple):
    """How the belief takes an observation.

    rows: those that count; excess: the least NIS over the gate, at least 1; placed: it placed its observer
    (lost_observer.py); joins: its subject enters by it, for the first time or because its belief is given up for it.
    """

    rows: int
    excess: float
    placed: bool
    joins: bool


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
def judge(belief: Belief, event: EventRow, rows: int, agrees: bool, joins: bool) -> None:
    """Note whether an observation agrees with the belief that it tests, or what its surprise makes doubtful."""
    answering = answers_for(belief, event)
    if agrees:
        agree(belief.memory[answering], event.at, rows)
    elif not joins and (answering != event.subject or belief.entities[event.observer].kind == KIND_CAMERA):
        doubt_velocity(belief.memory[answering])


@kernel()
def accuse(
    state: State, tables: Tables, event: EventRow, wild: Tested, used: Hypothesis, out: OutcomeRow
) -> Tested:  # fmt: skip
    """Decide what is wrong where an observation is far beyond the gate; the verdict is TURNED, PENDING or a refusal."""
    make_all(state)
    first = belief_of(state, tables, 0)
    sensor, settings, rows = tables.sensors[event.sensor], tables.settings, wild.rows
    out.verdict = blame(first, deferred_of(state, 0), sensor, settings, event, rows, used)
    if out.verdict == TURNED:
        return Tested(YAW, confront_place(state, tables, event, used), False, False)
    if out.verdict != PENDING:
        return wild
    if answers_for(first, event) == event.subject:
        return Tested(rows, wild.excess, False, True)
    return Tested(rows, place_observer(state, tables, event, rows, used), True, False)


@kernel()
def confirm(state: State, tables: Tables, event: EventRow, rows: int, used: Hypothesis, out: OutcomeRow) -> Tested:
    """Test an observation of a known subject against the belief; the verdict is TURNED, PENDING or a refusal."""
    first, believed = belief_of(state, tables, 0), state.means.copy()
    face_subject(state, tables, event, rows, used, False)
    tested, mode = Tested(rows, 1.0, False, False), likeliest(state.weights, used.innovations)
    if mode < 0:
        out.verdict = SINGULAR
        return tested
    write_outcome(out, used.innovations[mode])
    write_ahead(out, first.entities[event.subject], used.innovations[mode])
    tested = Tested(rows, max(least_nis(used.innovations) / tables.settings.gates[rows], 1.0), False, False)
    if tested.excess > tables.settings.wild_gates:
        tested = accuse(state, tables, event, tested, used, out)
        if out.verdict == TURNED:
            write_outcome(out, used.innovations[mode])
        elif out.verdict != PENDING:
            copy_matrix(believed, state.means)
            return tested
    judge(first, event, tested.rows, tested.excess == 1.0 and not tested.placed, tested.joins)
    return tested

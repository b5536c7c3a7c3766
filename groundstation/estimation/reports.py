"""Applies an entity's report of its own motion at its measurement time: used within the gate, or compared; compiled.

It is a claim, not a sighting. No entity joins by it, no belief is given up for it, and it does not count as seen; it
corrects only its own entity's block, so that a target with false reports moves no robot.
"""

import numpy as np

from groundstation.estimation.correction import apply_to_block
from groundstation.estimation.deferred import make_all
from groundstation.estimation.evidence import confront, least_nis, likeliest, set_noise, weigh
from groundstation.estimation.filter_state import Hypothesis, State, Tables, belief_of
from groundstation.estimation.linear import wrap
from groundstation.estimation.observe import refusal
from groundstation.estimation.records import (
    ACCEPTED,
    COMPARED,
    IMPLAUSIBLE,
    MAX_ROWS,
    PENDING,
    SINGULAR,
    EventRow,
    Innovation,
    OutcomeRow,
)
from groundstation.estimation.update import read, write_outcome
from groundstation.kernel import kernel

_INNOVATION = Innovation.dtype


@kernel()
def heed(state: State, tables: Tables, event: EventRow, rows: int, told: Hypothesis) -> None:
    """Correct the subject's block in every mode that can use the report, and weigh the modes by it."""
    for m in range(state.means.shape[0]):
        belief = belief_of(state, tables, m)
        if told.innovations[m].nis >= 0.0:
            block = belief.entities[event.subject]
            apply_to_block(belief.mean, belief.P, block, rows, told.HP[m], told.innovations[m])
            if block.at_yaw >= 0:
                belief.mean[block.start + block.at_yaw] = wrap(belief.mean[block.start + block.at_yaw])
    weigh(state.weights, told.innovations, rows, 1.0)


@kernel()
def report(state: State, tables: Tables, event: EventRow, out: OutcomeRow) -> None:
    """Compare the belief with an entity's report of its motion; a REPORTED event within the gate is used."""
    make_all(state)
    modes, first = state.means.shape[0], belief_of(state, tables, 0)
    innovations = np.zeros((1, modes), _INNOVATION)
    HP = np.empty((modes, MAX_ROWS, state.means.shape[1]))
    told = Hypothesis(np.zeros(MAX_ROWS), np.zeros((MAX_ROWS, MAX_ROWS)), innovations[0], HP)
    unused_s = event.at - state.used_at[event.sensor, event.subject]
    rows = read(first, tables.sensors[event.sensor], event, event.measured, unused_s, told.z, told.R)
    out.verdict = -rows if rows < 0 else refusal(first, event, rows)
    if out.verdict != PENDING:
        return
    set_noise(told.innovations, told.R)
    confront(state, tables, event, rows, told)
    mode = likeliest(state.weights, told.innovations)
    if mode < 0:
        out.verdict = SINGULAR
        return
    write_outcome(out, told.innovations[mode])
    out.verdict = ACCEPTED if least_nis(told.innovations) <= tables.settings.gates[rows] else IMPLAUSIBLE
    if out.verdict == ACCEPTED and event.kind != COMPARED:
        heed(state, tables, event, rows, told)
        state.used_at[event.sensor, event.subject] = event.at

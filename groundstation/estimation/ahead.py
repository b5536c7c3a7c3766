"""Predicts several steps in which no measurement needs P: first each block by itself, then P in one pass; compiled.

While readings wait, each tick predicts some ten steps. A block of P is predicted beside an identity, which becomes the
product of all its steps; the rest of the block's rows is multiplied by that once.
"""

from typing import Any, NamedTuple

import numpy as np

from groundstation.arrays import IntVector, Matrix
from groundstation.estimation.filter_state import Belief, Inputs, Span, State, Tables, belief_of, deferred_of
from groundstation.estimation.model_kernels import call_begin, call_predict
from groundstation.estimation.motion import copy_out, finish_rows, open_rows
from groundstation.estimation.records import COMPARED, MAX_BLOCK, OBSERVATION, REPORTED, EntityRow, EventRow
from groundstation.estimation.register_blocks import ROWS, add_rows
from groundstation.kernel import copy_rows, kernel

_ENTITY = EntityRow.dtype


class Work(NamedTuple):
    """Room for one block in place of P, (2 MAX_BLOCK, 2 MAX_BLOCK): only the block's rows are used, with its transition
    matrix from column MAX_BLOCK on; its rows of P as moved (MAX_BLOCK, n); factors of four of these (4, MAX_BLOCK) by
    which rows `at` of P."""

    block: Matrix
    rows: Matrix
    factors: Matrix
    at: IntVector


@kernel(inlined=True)
def is_reading(event: EventRow) -> bool:
    """Return whether an event is a sensor's reading, not a change of the entities in the state."""
    return bool(event.kind == OBSERVATION or event.kind == REPORTED or event.kind == COMPARED)


@kernel()
def quiet_from(inputs: Inputs, span: Span, modes: int) -> int:
    """Return the first step from which on nothing needs P: readings wait, there are no heights, no entity enters.

    Several modes are mixed in each step, which needs P.
    """
    quiet, ring = max(span.waiting, span.first), inputs.odometry.shape[0]
    if modes > 1:
        return span.last + 1
    for i in range(inputs.order.shape[0]):
        event = inputs.events[inputs.order[i]]
        if event.step >= quiet and event.at <= span.now and not is_reading(event):
            quiet = event.step + 1
    for k in range(quiet, span.last + 1):
        odometry = inputs.odometry[k % ring]
        for e in range(odometry.shape[0]):
            if odometry[e].height_count > 0.0:
                quiet = k + 1
    return quiet


@kernel(inlined=True)
def take_apart(P: Matrix, entity: EntityRow, block: Matrix) -> None:
    """Copy an entity's block of P, with an identity beside it."""
    for i in range(MAX_BLOCK):
        for j in range(block.shape[1]):
            block[i, j] = 1.0 if j == MAX_BLOCK + i else 0.0
    for i in range(entity.size):
        for j in range(entity.size):
            block[i, j] = P[entity.start + i, entity.start + j]


@kernel(inlined=True)
def put_back(P: Matrix, entity: EntityRow, work: Work) -> None:
    """Multiply an entity's rows of P by its block's transition matrix, and put in the block."""
    block, rows, factors, at = work.block, work.rows, work.factors, work.at
    start, size, n = entity.start, entity.size, P.shape[1]
    for row in range(0, size, ROWS):
        count = 0
        for k in range(size):
            from_k = MAX_BLOCK + k
            a, b = block[row, from_k], block[row + 1, from_k]
            c, d = block[row + 2, from_k], block[row + 3, from_k]
            if a != 0.0 or b != 0.0 or c != 0.0 or d != 0.0:
                factors[0, count], factors[1, count], factors[2, count], factors[3, count] = a, b, c, d
                at[count] = start + k
                count += 1
        for i in range(row, row + ROWS):
            for j in range(n):
                rows[i, j] = 0.0
        add_rows(rows[row : row + ROWS], factors, P, at, count)
    for i in range(size):
        for j in range(n):
            P[start + i, j] = rows[i, j]
        for j in range(size):
            P[start + i, start + j] = block[i, j]


@kernel()
def predict_ahead(state: State, tables: Tables, inputs: Inputs, span: Span, first: int) -> None:
    """Run the steps of a span from the first quiet one on, as `replay` would; P stays exactly symmetric.

    Means and blocks are the same to the bit, covariances between entities to rounding.
    """
    belief, deferred, step_s, gate = (
        belief_of(state, tables, 0), deferred_of(state, 0), tables.settings.step_s, tables.settings.gates[1]
    )  # fmt: skip
    P, ring, open_from, stop = belief.P, inputs.odometry.shape[0], 0, 0
    work = Work(
        np.empty((2 * MAX_BLOCK, 2 * MAX_BLOCK)), np.empty((MAX_BLOCK, P.shape[1])),
        np.empty((ROWS, MAX_BLOCK)), np.empty(MAX_BLOCK, np.int64),
    )  # fmt: skip
    apart: Any = np.empty(belief.entities.shape[0], _ENTITY)
    copy_rows(belief.entities, apart)
    for e in range(belief.entities.shape[0]):
        entity = belief.entities[e]
        apart[e].start, moves = 0, belief.memory[e].active != 0 and entity.predict != 0
        own = Belief(belief.mean[entity.start :], work.block, apart, belief.memory)
        if moves:
            take_apart(P, entity, work.block)
        for k in range(first, span.last + 1):
            if entity.begin != 0:
                call_begin(entity.begin, (belief, deferred, inputs.odometry[k % ring][e], e, step_s, gate))
            t = k * step_s
            end = min((k + 1) * step_s, max(span.now, t))
            if moves and end > t:
                call_predict(entity.predict, (own, e, end - t))
        if moves:
            open_from = open_rows(P, entity, open_from, stop)
            put_back(P, entity, work)
            stop = finish_rows(P, entity, open_from)
    copy_out(P, open_from, stop)

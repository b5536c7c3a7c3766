"""Corrections of P deferred until P itself is needed, so that many are made while P is read once.

Sightings of one picture have the same time: until time advances, only the next of them needs P, and only a few of its
rows. Meanwhile the covariance is P - V^T V.
"""

import numpy as np

from groundstation.arrays import IntVector, Matrix
from groundstation.estimation.filter_state import Deferred, State, deferred_of
from groundstation.estimation.register_blocks import subtract_rows, subtract_square
from groundstation.kernel import kernel

MOST = 32  # rows of V that are kept


@kernel()
def make(P: Matrix, deferred: Deferred) -> None:
    """Make the deferred corrections."""
    if deferred.used[0] > 0:
        subtract_square(P, deferred.V, deferred.used[0])
        deferred.used[0] = 0


@kernel()
def make_all(state: State) -> None:
    """Make the deferred corrections in all modes: P is then the covariance."""
    for m in range(state.means.shape[0]):
        make(state.covariances[m], deferred_of(state, m))


@kernel(inlined=True)
def put_off(P: Matrix, deferred: Deferred, rows: int) -> int:
    """Return the first of the new rows of V to be written, which count from now on."""
    if deferred.used[0] + rows > deferred.V.shape[0]:
        make(P, deferred)
    first = deferred.used[0]
    deferred.used[0] = first + rows
    return int(first)


@kernel(inlined=True)
def count_in(W: Matrix, F: Matrix, at: IntVector, count: int, deferred: Deferred) -> None:
    """Subtract the effect of the deferred corrections from W = F P (4, n); F is zero except in the columns `at`."""
    rows = deferred.used[0]
    if rows == 0:
        return
    V, C = deferred.V, np.empty((W.shape[0], rows))
    for i in range(W.shape[0]):
        for q in range(rows):
            value = 0.0
            for k in range(count):
                value += F[i, k] * V[q, at[k]]
            C[i, q] = value
    subtract_rows(W, C, V, rows)


@kernel(inlined=True)
def variance_of(P: Matrix, deferred: Deferred, i: int) -> float:
    """Return one entry's variance."""
    value = P[i, i]
    for q in range(deferred.used[0]):
        value -= deferred.V[q, i] * deferred.V[q, i]
    return float(value)

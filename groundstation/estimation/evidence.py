"""The likelihood of an observation in each mode's belief, and which modes can use it; compiled."""

import math

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.correction import log_determinant
from groundstation.estimation.filter_state import Hypothesis, State, Tables, belief_of, deferred_of
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.records import EventRow, Innovation
from groundstation.estimation.update import linearise
from groundstation.kernel import Rows, kernel


@kernel(inlined=True)
def set_noise(innovations: Rows[Innovation], R: Matrix) -> None:
    """Set the noise of the reading in all modes."""
    for m in range(innovations.shape[0]):
        copy_matrix(R, innovations[m].R)


@kernel()
def confront(state: State, tables: Tables, event: EventRow, rows: int, hypothesis: Hypothesis) -> float:
    """Linearise in all modes with their given R; returns the log evidence of the hypothesis."""
    modes, sensor = state.means.shape[0], tables.sensors[event.sensor]
    scores, best = np.empty(modes), -math.inf
    for m in range(modes):
        innovation = hypothesis.innovations[m]
        belief, deferred = belief_of(state, tables, m), deferred_of(state, m)
        linearise(belief, deferred, sensor, event, rows, hypothesis.z, innovation, hypothesis.HP[m])
        scores[m] = -math.inf
        if innovation.nis >= 0.0:
            scores[m] = math.log(max(state.weights[m], 1e-300)) - 0.5 * (
                innovation.nis + log_determinant(innovation.factor, rows)
            )
        best = max(best, scores[m])
    if best == -math.inf:
        return best
    total = 0.0
    for m in range(modes):
        total += math.exp(scores[m] - best)
    return best + math.log(total)


@kernel(inlined=True)
def weigh(weights: Vector, innovations: Rows[Innovation], rows: int, factor: float) -> None:
    """Multiply the modes' probabilities by the likelihood of the observation as it was used (S times factor).

    At least one mode can use it. A mode whose S is not positive definite is no longer a distribution: its probability
    becomes 0, and the next mixing replaces it by the others.
    """
    modes = weights.shape[0]
    if modes == 1:
        return
    scores, best = np.empty(modes), -math.inf
    for m in range(modes):
        scores[m] = -math.inf
        if innovations[m].nis >= 0.0:
            scores[m] = math.log(max(weights[m], 1e-300)) - 0.5 * (
                innovations[m].nis / factor + log_determinant(innovations[m].factor, rows)
            )
        best = max(best, scores[m])
    total = 0.0
    for m in range(modes):
        weights[m] = math.exp(scores[m] - best)
        total += weights[m]
    for m in range(modes):
        weights[m] /= total


@kernel(inlined=True)
def likeliest(weights: Vector, innovations: Rows[Innovation]) -> int:
    """Return the most probable mode in which the observation can be used, or -1."""
    best = -1
    for m in range(weights.shape[0]):
        if innovations[m].nis >= 0.0 and (best < 0 or weights[m] > weights[best]):
            best = m
    return best


@kernel(inlined=True)
def least_nis(innovations: Rows[Innovation]) -> float:
    """Return the smallest NIS of the modes in which the observation can be used."""
    value = math.inf
    for m in range(innovations.shape[0]):
        if 0.0 <= innovations[m].nis < value:
            value = innovations[m].nis
    return value

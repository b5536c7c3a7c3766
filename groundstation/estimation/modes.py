"""Interacting multiple models over the whole joint belief.

Each mode has a joint mean and covariance of its own; modes differ in how one target moves. Mixing takes the moments of
the mixture over the *whole* state, robots and cross-covariances included: every mixed P is a sum of positive definite
matrices and of outer products, so it is positive definite, with the cross-covariances of the mixture. Bar-Shalom, Li,
Kirubarajan (2001), section 11.6.6.
"""

from groundstation.arrays import Matrix, MatrixStack, Vector
from groundstation.estimation.filter_state import Moments, State, Tables
from groundstation.estimation.linear import wrap
from groundstation.estimation.records import EntityRow
from groundstation.kernel import Rows, kernel


@kernel()
def difference(a: Vector, b: Vector, entities: Rows[EntityRow], out: Vector) -> None:
    """Write a - b of two means, headings wrapped."""
    for j in range(a.shape[0]):
        out[j] = a[j] - b[j]
    for e in range(entities.shape[0]):
        if entities[e].at_yaw >= 0:
            index = entities[e].start + entities[e].at_yaw
            out[index] = wrap(out[index])


@kernel()
def write_moments(
    means: Matrix, covariances: MatrixStack, weights: Vector, entities: Rows[EntityRow], work: Matrix, out: Moments
) -> None:
    """Write mean and covariance of a mixture; weights sum to 1, work (2, n)."""
    mean, P = out.mean, out.P
    n, heaviest = mean.shape[0], 0
    for m in range(1, weights.shape[0]):
        if weights[m] > weights[heaviest]:
            heaviest = m
    shift, d = work[0], work[1]
    for j in range(n):
        shift[j] = 0.0
    for m in range(weights.shape[0]):
        difference(means[m], means[heaviest], entities, d)
        for j in range(n):
            shift[j] += weights[m] * d[j]
    for i in range(n):
        mean[i] = means[heaviest, i] + shift[i]
        for j in range(n):
            P[i, j] = 0.0
    for m in range(weights.shape[0]):
        difference(means[m], means[heaviest], entities, d)
        for i in range(n):
            f = weights[m] * (d[i] - shift[i])
            for j in range(n):
                P[i, j] += weights[m] * covariances[m, i, j] + f * (d[j] - shift[j])
    for e in range(entities.shape[0]):
        if entities[e].at_yaw >= 0:
            index = entities[e].start + entities[e].at_yaw
            mean[index] = wrap(mean[index])
    for i in range(n):
        for j in range(i):
            P[i, j] = P[j, i]


@kernel()
def mix(state: State, tables: Tables) -> None:
    """Replace each mode's belief by the mixture of those from which it can have come in one step."""
    modes, weights, transition = state.means.shape[0], state.weights, tables.transition
    if modes == 1:
        return
    old_means, old_P, old = state.means.copy(), state.covariances.copy(), weights.copy()
    share, work = weights.copy(), old_means[:2].copy()
    for to in range(modes):
        weights[to] = 0.0
        for source in range(modes):
            weights[to] += transition[source, to] * old[source]
        for source in range(modes):
            share[source] = transition[source, to] * old[source] / weights[to]
        out = Moments(state.means[to], state.covariances[to])
        write_moments(old_means, old_P, share, tables.entities[0], work, out)


def moments_of(state: State) -> Moments:
    """Return the arrays for the belief over all modes: those of the only mode, if there is just one."""
    moments = Moments(state.means[0], state.covariances[0])
    return moments if len(state.weights) == 1 else Moments(*(part.copy() for part in moments))


@kernel()
def combine(state: State, tables: Tables, out: Moments) -> None:
    """Write the belief over all modes; a single one is that belief (`moments_of`)."""
    if state.means.shape[0] == 1:
        return
    work = state.means[:2].copy()
    write_moments(state.means, state.covariances, state.weights, tables.entities[0], work, out)

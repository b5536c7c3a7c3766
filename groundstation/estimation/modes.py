"""Interacting multiple models over the whole joint belief.

Each mode has a joint mean and covariance of its own; modes differ in how one target moves. Mixing takes the moments of
the mixture over the *whole* state, robots and cross-covariances included: every mixed P is a sum of positive definite
matrices and of outer products, so that it is positive definite and its cross-covariances are those of the mixture.
Bar-Shalom, Li, Kirubarajan (2001), section 11.6.6.
"""

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import copy_matrix, wrap


@kernel("void(float64[::1], float64[::1], int64[:,::1], float64[::1])")
def difference(a: Array, b: Array, entities: IntArray, out: Array) -> None:
    """Write a - b of two means, headings wrapped."""
    for j in range(a.shape[0]):
        out[j] = a[j] - b[j]
    for e in range(entities.shape[0]):
        if entities[e, s.AT_YAW] >= 0:
            index = entities[e, s.ENTITY_START] + entities[e, s.AT_YAW]
            out[index] = wrap(out[index])


@kernel(
    "void(float64[:,::1], float64[:,:,::1], float64[::1], int64[:,::1], float64[:,::1], float64[::1], float64[:,::1])"
)
def moments(
    means: Array, covariances: Array, weights: Array, entities: IntArray, work: Array, mean: Array, P: Array
) -> None:
    """Write mean and covariance of a mixture; weights sum to 1, work (2, n)."""
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
        if entities[e, s.AT_YAW] >= 0:
            index = entities[e, s.ENTITY_START] + entities[e, s.AT_YAW]
            mean[index] = wrap(mean[index])
    for i in range(n):
        for j in range(i):
            P[i, j] = P[j, i]


@kernel("void(float64[:,::1], float64[:,:,::1], float64[::1], float64[:,::1], int64[:,::1])")
def mix(means: Array, covariances: Array, weights: Array, transition: Array, entities: IntArray) -> None:
    """Let each mode's belief become the mixture of those from which it can have come in one step."""
    modes = means.shape[0]
    if modes == 1:
        return
    old_means, old_P, old = means.copy(), covariances.copy(), weights.copy()
    share, work = weights.copy(), old_means[:2].copy()
    for to in range(modes):
        weights[to] = 0.0
        for source in range(modes):
            weights[to] += transition[source, to] * old[source]
        for source in range(modes):
            share[source] = transition[source, to] * old[source] / weights[to]
        moments(old_means, old_P, share, entities, work, means[to], covariances[to])


@kernel("void(float64[:,::1], float64[:,:,::1], float64[::1], int64[:,::1], float64[::1], float64[:,::1])")
def combine(means: Array, covariances: Array, weights: Array, entities: IntArray, mean: Array, P: Array) -> None:
    """Write the belief over all modes."""
    if means.shape[0] == 1:
        for j in range(mean.shape[0]):
            mean[j] = means[0, j]
        copy_matrix(covariances[0], P)
        return
    work = means[:2].copy()
    moments(means, covariances, weights, entities, work, mean, P)

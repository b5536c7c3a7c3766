"""The planning cost of one topology as a function of the scaled controls, with its exact gradient."""

from numba import njit, types

from groundstation.planning.planar.edges import edge_information
from groundstation.planning.planar.problem import PROBLEM, WORKSPACE
from groundstation.planning.planar.rollout import add_position_gradient, adjoint_columns, rollout_cost

_f1, _f8, _i8 = types.float64[::1], types.float64, types.int64


@njit(types.void(_f1, PROBLEM, WORKSPACE), cache=True, nogil=True)
def predict_positions(controls, problem, work):  # type: ignore[no-untyped-def]
    """Write the mean positions of all entities at steps 1..h under controls x = u / u_max, x (segments * n * 2)."""
    constants, robots = problem.constants, problem.mean.shape[0] - 1
    reach = constants[4] * constants[6]
    for i in range(problem.steps):
        offset = (i * problem.segments // problem.steps) * robots * 2
        before = problem.mean if i == 0 else work.position[i - 1]
        for a in range(robots):
            work.position[i, a, 0] = before[a, 0] + reach * controls[offset + 2 * a]
            work.position[i, a, 1] = before[a, 1] + reach * controls[offset + 2 * a + 1]
        work.position[i, robots, 0] = before[robots, 0] + constants[4] * constants[7]
        work.position[i, robots, 1] = before[robots, 1] + constants[4] * constants[8]


@njit(_f8(_i8, PROBLEM, WORKSPACE), cache=True, nogil=True)
def weighted_cost(count, problem, work):  # type: ignore[no-untyped-def]
    """Return the cost for the edge informations that stand in the workspace."""
    work.prior[0] = problem.information
    return rollout_cost(
        work.prior,
        work.factor,
        work.edges,
        count,
        work.weights,
        problem.variance,
        problem.constants[5],
        problem.stable,
        work.square,
        problem.addresses,
        work.integers,
    )


@njit(_f8(_f1, _i8, PROBLEM, WORKSPACE), cache=True, nogil=True)
def cost(controls, count, problem, work):  # type: ignore[no-untyped-def]
    """Return the cost [m^2] of the topology whose `count` edges stand in the workspace; -1 on a numerical failure."""
    predict_positions(controls, problem, work)
    for i in range(problem.steps):
        edge_information(
            work.position[i], work.edges, count, problem.constants, work.distance[i], work.exponent, work.weights[i]
        )
    return weighted_cost(count, problem, work)


@njit(types.void(types.float64[:, :, ::1], _i8, _f1, _i8), cache=True, nogil=True)
def _collect(step_gradient, segments, gradient, robots):  # type: ignore[no-untyped-def]
    """Sum dc/dposition over the steps each control moves: u_j moves every step i >= j (reversed cumulative sum)."""
    steps = step_gradient.shape[0]
    gradient[:] = 0.0
    for i in range(steps - 1, -1, -1):
        offset = (i * segments // steps) * robots * 2
        if i + 1 < steps:
            step_gradient[i] += step_gradient[i + 1]
        for a in range(robots):
            gradient[offset + 2 * a] += step_gradient[i, a, 0]
            gradient[offset + 2 * a + 1] += step_gradient[i, a, 1]


@njit(_f8(_f1, _i8, PROBLEM, WORKSPACE, _f1), cache=True, nogil=True)
def cost_and_gradient(controls, count, problem, work, gradient):  # type: ignore[no-untyped-def]
    """Return the cost [m^2] and write its gradient in the scaled controls (segments * n * 2)."""
    value = cost(controls, count, problem, work)
    if value < 0.0:
        return value
    adjoint_columns(
        work.prior, work.factor, problem.constants[5], work.columns, work.carried, problem.addresses, work.integers
    )
    steps, robots = problem.steps, problem.mean.shape[0] - 1
    reach = problem.constants[4] * problem.constants[6]
    work.step_gradient[:] = 0.0
    for i in range(steps):
        add_position_gradient(
            work.position[i],
            work.edges,
            count,
            work.distance[i],
            work.weights[i],
            work.columns[i],
            steps - i,
            problem.constants,
            reach,
            work.step_gradient[i],
        )
    _collect(work.step_gradient, problem.segments, gradient, robots)
    return value

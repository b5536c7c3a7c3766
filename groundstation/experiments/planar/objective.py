"""The planning cost of one topology as a function of the scaled controls, with its exact gradient.

All functions work on the topology that `load_topology` put into the workspace; controls x = u / u_max
(segments * n * 2) are in its sorted order.
"""

from numba import njit, types

from groundstation.experiments.planar.edges import edge_information, position_gradient
from groundstation.experiments.planar.problem import PROBLEM, WORKSPACE
from groundstation.experiments.planar.rollout import adjoint_columns, rollout_cost

_f1, _f8, _i8 = types.float64[::1], types.float64, types.int64


@njit(types.void(_f1, PROBLEM, WORKSPACE), cache=True, nogil=True)
def predict_positions(controls, problem, work):  # type: ignore[no-untyped-def]
    """Write the mean positions of all entities at steps 1..h."""
    constants, robots = problem.constants, problem.mean.shape[0] - 1
    reach = constants[4] * constants[6]
    for i in range(problem.steps):
        offset = (i * problem.segments // problem.steps) * robots * 2
        for axis in range(2):
            for a in range(robots):
                before = work.mean[axis, a] if i == 0 else work.position[i - 1, axis, a]
                work.position[i, axis, a] = before + reach * controls[offset + 2 * a + axis]
            before = work.mean[axis, robots] if i == 0 else work.position[i - 1, axis, robots]
            work.position[i, axis, robots] = before + constants[4] * constants[7 + axis]


@njit(_f8(PROBLEM, WORKSPACE), cache=True, nogil=True)
def weighted_cost(problem, work):  # type: ignore[no-untyped-def]
    """Return the cost for the edge informations that stand in the workspace."""
    return rollout_cost(
        work.prior,
        work.factor,
        work.rows,
        work.weights,
        work.variance,
        problem.constants[5],
        problem.stable,
        work.square,
        work.panel,
    )


@njit(_f8(_f1, PROBLEM, WORKSPACE), cache=True, nogil=True)
def cost(controls, problem, work):  # type: ignore[no-untyped-def]
    """Return the cost [m^2]; -1 on a numerical failure."""
    predict_positions(controls, problem, work)
    for i in range(problem.steps):
        edge_information(i, work.position, work.rows, problem.constants, work.distance, work.scratch, work.weights)
    return weighted_cost(problem, work)


@njit(types.void(types.float64[:, :, ::1], _i8, _f1, _i8), cache=True, nogil=True)
def _collect(step_gradient, segments, gradient, robots):  # type: ignore[no-untyped-def]
    """Sum dc/dposition over the steps each control moves: u_j moves every step i >= j (reversed cumulative sum)."""
    steps = step_gradient.shape[0]
    gradient[:] = 0.0
    for i in range(steps - 1, -1, -1):
        offset = (i * segments // steps) * robots * 2
        for axis in range(2):
            for a in range(robots):
                if i + 1 < steps:
                    step_gradient[i, axis, a] += step_gradient[i + 1, axis, a]
                gradient[offset + 2 * a + axis] += step_gradient[i, axis, a]


@njit(_f8(_f1, PROBLEM, WORKSPACE, _f1), cache=True, nogil=True)
def cost_and_gradient(controls, problem, work, gradient):  # type: ignore[no-untyped-def]
    """Return the cost [m^2] and write its gradient in the scaled controls."""
    value = cost(controls, problem, work)
    if value < 0.0:
        return value
    adjoint_columns(work.prior, work.factor, work.variance, problem.constants[5], work.columns)
    for i in range(problem.steps):
        position_gradient(
            i,
            work.position,
            work.rows,
            work.distance,
            work.weights,
            work.columns,
            problem.constants,
            work.scratch,
            work.gradient,
        )
    _collect(work.gradient, problem.segments, gradient, problem.mean.shape[0] - 1)
    return value

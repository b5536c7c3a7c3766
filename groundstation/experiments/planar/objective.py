"""The planning cost of one topology as a function of the scaled controls, with its exact gradient.

All functions work on the topology that `load_topology` put into the workspace; controls x = u / u_max
(segments * n * 2) are in its sorted order.
"""

from groundstation.arrays import MatrixStack, Vector
from groundstation.experiments.planar.edges import edge_information, position_gradient
from groundstation.experiments.planar.records import PlanarProblem, Workspace, X
from groundstation.experiments.planar.rollout import adjoint_columns, rollout_cost
from groundstation.kernel import kernel


@kernel()
def predict_positions(controls: Vector, problem: PlanarProblem, work: Workspace) -> None:
    """Write the mean positions of all entities at steps 1..h."""
    constants, robots, mean, position = problem.constants, problem.mean.shape[0] - 1, work.mean, work.position
    reach = constants.step_s * constants.max_speed_m_s
    for i in range(problem.steps):
        offset = (i * problem.segments // problem.steps) * robots * 2
        for axis in range(2):
            for a in range(robots):
                before = mean[axis, a] if i == 0 else position[i - 1, axis, a]
                position[i, axis, a] = before + reach * controls[offset + 2 * a + axis]
            before = mean[axis, robots] if i == 0 else position[i - 1, axis, robots]
            speed = constants.target_velocity_x if axis == X else constants.target_velocity_y
            position[i, axis, robots] = before + constants.step_s * speed


@kernel()
def cost(controls: Vector, problem: PlanarProblem, work: Workspace) -> float:
    """Return the cost [m^2]; -1 on a numerical failure."""
    predict_positions(controls, problem, work)
    for i in range(problem.steps):
        edge_information(i, problem, work)
    return rollout_cost(problem, work)


@kernel()
def _collect(step_gradient: MatrixStack, segments: int, gradient: Vector, robots: int) -> None:
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


@kernel()
def cost_and_gradient(controls: Vector, problem: PlanarProblem, work: Workspace, gradient: Vector) -> float:
    """Return the cost [m^2] and write its gradient in the scaled controls."""
    value = cost(controls, problem, work)
    if value < 0.0:
        return value
    adjoint_columns(problem.constants.discount, work)
    for i in range(problem.steps):
        position_gradient(i, problem, work)
    _collect(work.gradient, problem.segments, gradient, problem.mean.shape[0] - 1)
    return value

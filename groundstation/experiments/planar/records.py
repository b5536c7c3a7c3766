"""Records of the planar planner's kernels: one control step's problem, its scratch memory, and its candidates.

n robots, h steps; m: n + 1 padded to the vector width; entities are the robots, then the target.
"""

from typing import NamedTuple

from groundstation.arrays import IntMatrix, IntVector, Matrix, MatrixStack, Vector, WordVector

X, Y = 0, 1


class PlanarConstants(NamedTuple):
    """Constants of PlanarParameters on sensor, motion and cost; target_velocity (x, y) [m/s] by its components."""

    sigma_m: float
    range_m: float
    softness_m: float
    epsilon_m: float
    step_s: float
    discount: float
    max_speed_m_s: float
    target_velocity_x: float
    target_velocity_y: float
    tail: float


class PlanarProblem(NamedTuple):
    """Belief and constants of one control step.

    mean (n + 1, 2) [m; target last]; information (m, m): (P + Q)^-1 per axis, shared by all topologies;
    variance (n + 1): Q; segments: controls held over the horizon; stable: predict through the covariance.
    """

    mean: Matrix
    information: Matrix
    variance: Vector
    constants: PlanarConstants
    steps: int
    segments: int
    stable: bool


class Observers(NamedTuple):
    """Subjects of each observer, by row (n + 2): first subject and one past the last, in sorted order, and first edge.

    Row 0 is the global sensor, row a + 1 the robot at sorted place a; the last edge[n + 1] is the number of edges.
    """

    first: WordVector
    end: WordVector
    edge: WordVector


class Workspace(NamedTuple):
    """Scratch arrays of the kernels, and the topology at hand, its team sorted by level.

    order (n + 1): the entity at each sorted place; mean (2, m) and variance (n + 1) in sorted order; prior and
    factor (h, m, m); square (m, m) and panel (8, m); columns (h, h + 3, m); slopes and weights (h, edges): of each
    edge in each step, see `edge_information`; position and gradient (h, 2, m).
    """

    order: IntVector
    observers: Observers
    mean: Matrix
    variance: Vector
    prior: MatrixStack
    factor: MatrixStack
    square: Matrix
    panel: Matrix
    columns: MatrixStack
    slopes: Matrix
    weights: Matrix
    scratch: Vector
    position: MatrixStack
    gradient: MatrixStack


class Limits(NamedTuple):
    """Ends of a minimisation: scaled projected gradient, cost evaluations, or stop[0] != 0 (set by a thread)."""

    tolerance: float
    budget: int
    stop: IntVector


class Candidates(NamedTuple):
    """Candidate topologies with the search's results, one per row.

    levels (., n); bounds and costs [m^2], NaN where not begun; fates; controls (., segments * n * 2), scaled.
    """

    levels: IntMatrix
    bounds: Vector
    costs: Vector
    fates: IntVector
    controls: Matrix


class Optimum(NamedTuple):
    """The current topology at its optimum, by entity: robots, target, the global sensor (n + 2).

    controls (segments * n * 2), scaled; gradient: of the cost in them [m^2]; position (h, 2, n + 2) [m]; columns
    (h, h, n + 2): the adjoint's, of which row c of step i belongs to the variance after step h - 1 - c; held
    (h, n + 2): the diagonal of the information matrix of all steps [1/m^2].
    """

    level: IntVector
    controls: Vector
    gradient: Vector
    position: MatrixStack
    columns: MatrixStack
    held: Matrix

"""What the planner's kernels share: one topology's problem, and the tape of a rollout.

State of the planner: x, y, yaw of each robot (3 each), then x, y, vx, vy of each target (4 each); d entries.
n robots, k targets, m edges, h steps.
"""

from typing import NamedTuple

from groundstation.arrays import Matrix, MatrixStack, Vector
from groundstation.kernel import Record, Rows
from groundstation.sensing.visibility import CameraRow

# Columns of robots' states and of targets', and of a robot's pose.
X, Y, YAW = 0, 1, 2
VX, VY = 2, 3
POSE_YAW = 3
ROBOT_STATES, TARGET_STATES = 3, 4


class EdgeRow(Record):
    """An edge: row of its camera, number of its observer (-1: fixed in the world) and of its subject, robots first."""

    camera: int
    observer: int
    subject: int


class CostOptions(NamedTuple):
    """Settings of the cost that all topologies share.

    Noise densities: robot_position [m^2/s], robot_yaw [rad^2/s], target_acceleration [m^2/s^3]. The fence is where the
    soft wall begins [m; world].
    """

    step_s: float
    discount: float
    robot_position_noise: float
    robot_yaw_noise: float
    target_acceleration_noise: float
    repulsion_weight: float
    separation_m: float
    fence_weight: float
    fence: Matrix  # (2, 2): low and high of x, then of y
    effort_weight: float
    robot_weight: float


class CostProblem(NamedTuple):
    """One topology's cost as a function of the held controls.

    scale (3 n): bounds of the controls, for the effort; poses (n, 4): x, y, z, yaw; targets (k, 4): x, y, vx, vy;
    heights (h, n): predicted z [m]; prior (d, d); markers (n + k): heights above the robot's centre or the floor [m];
    target_weights (k), in state order.
    """

    scale: Vector
    poses: Matrix
    targets: Matrix
    heights: Matrix
    prior: Matrix
    edges: Rows[EdgeRow]
    cameras: Rows[CameraRow]
    markers: Vector
    target_weights: Vector
    options: CostOptions


class EdgeTape(Record):
    """What one edge saw in one step: informations of position and heading, their derivatives, the relative position.

    Derivatives are by the relative position (x, y) [world] and by the observer's yaw.
    """

    w: float
    w_x: float
    w_y: float
    w_yaw: float
    v: float
    v_x: float
    v_y: float
    v_yaw: float
    x: float
    y: float


class Tape(NamedTuple):
    """Everything that the adjoint needs of a rollout.

    path (h + 1, n, 3): x, y, yaw; motion (h, n, 3): displacement and direction; yaw_columns (h, n, d): F P e_yaw;
    sightings (h m): by step, then edge; gains and yaw_rows (h, 3 m, d): of each scalar correction;
    penalties (h, n, 3): their derivatives by x, y.
    """

    path: MatrixStack
    motion: MatrixStack
    yaw_columns: MatrixStack
    sightings: Rows[EdgeTape]
    gains: MatrixStack
    yaw_rows: MatrixStack
    penalties: MatrixStack


class Combination(NamedTuple):
    """The scalar a^T x that a correction measures: a = e_to - e_origin + lever e_yaw; an index < 0 is left out."""

    to: int
    origin: int
    yaw: int
    lever: float

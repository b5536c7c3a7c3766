"""The data that the planner's kernels share: one topology's problem, and the tape of a rollout.

State of the planner, the same for both axes of the floor plan: a position of each robot, then position and velocity of
each target (2 each); d entries. Headings are variances of their own, beside it (docs/explanation/planning.md 1).
n robots, k targets, m edges, h steps.
"""

from typing import NamedTuple

from groundstation.arrays import Matrix, MatrixStack, Vector
from groundstation.kernel import Record, Rows
from groundstation.sensing.occlusion import BoxRow
from groundstation.sensing.visibility import CameraRow

# Columns of a robot's path, of its controls (and of derivatives by its path), of a target's mean, of a robot's pose.
X, Y, YAW, COS, SIN, Z = 0, 1, 2, 3, 4, 5
HEIGHT = 3
VX, VY = 2, 3
POSE_Z, POSE_YAW = 2, 3
ROBOT_CONTROLS, TARGET_STATES = 4, 2


class EdgeRow(Record):
    """An edge: row of its camera, number of its observer (-1: fixed in the world) and of its subject, robots first.

    wanted: 1 for an edge of the topology, whose tail attracts; 0 for a possible sighting besides. blur_m2, turn_rad2:
    present variances of the relative position per axis and of the observer's direction of view.
    """

    camera: int
    observer: int
    subject: int
    wanted: int
    blur_m2: float
    turn_rad2: float


class CostOptions(NamedTuple):
    """Settings of the cost that all topologies share.

    Noise densities: robot_position [m^2/s], robot_yaw [rad^2/s], target_acceleration [m^2/s^3]. The fence is where the
    soft wall begins [m; world]; obstacle_m: how far from an obstacle its soft wall begins, with the fence's weight.
    readings: sightings per step of a marker in view. height_m: origin of the heights among the controls.
    """

    steps: int
    step_s: float
    discount: float
    robot_position_noise: float
    robot_yaw_noise: float
    target_acceleration_noise: float
    repulsion_weight: float
    separation_m: float
    fence_weight: float
    fence: Matrix  # (2, 2): low and high of x, then of y
    obstacle_m: float
    effort_weight: float
    robot_weight: float
    readings: float
    height_m: float


class CostProblem(NamedTuple):
    """One topology's cost as a function of the held controls.

    scale (4 n): bounds of the controls, for the effort; poses (n, 4): x, y, z, yaw; targets (k, 4): x, y, vx, vy;
    climbs (n): climb limit of each [m/s]; prior (d, d), per axis; yaw_variances (n) [rad^2]; markers (n + k): heights
    above the robot's centre or the floor [m]; target_weights (k), in state order; boxes: obstacles, which hide markers.
    """

    scale: Vector
    poses: Matrix
    targets: Matrix
    climbs: Vector
    prior: Matrix
    yaw_variances: Vector
    edges: Rows[EdgeRow]
    cameras: Rows[CameraRow]
    markers: Vector
    target_weights: Vector
    boxes: Rows[BoxRow]
    options: CostOptions


class EdgeTape(Record):
    """The view of one edge in one step: availability, its derivatives by relative position [world] and observer's yaw.

    x, y: relative position [m]; square, z: squared distance from the camera, and its vertical part [m]; variance of a
    position per axis and w, the information; v: information of the heading; along_x, along_y, along_z: derivatives of
    the availability if observer and subject move alike, past a box [1/m; world], only where there are boxes.
    """

    a: float
    a_x: float
    a_y: float
    a_z: float
    a_yaw: float
    x: float
    y: float
    z: float
    square: float
    variance: float
    w: float
    v: float
    along_x: float
    along_y: float
    along_z: float


class Tape(NamedTuple):
    """The data of a rollout that the adjoint needs.

    path (h + 1, n, 6): x, y, yaw, its cosine and sine, z; motion (h, n, 4): displacement, direction, and the derivative
    of z by the commanded height; sightings (h m): by step, then edge; informations (h, d, d) before and covariances (h,
    d, d) after each correction, padded to whole vectors; yaws_before, yaws_after (h, n): variances; penalties (h, n,
    3): their derivatives by x, y, z.
    """

    path: MatrixStack
    motion: MatrixStack
    sightings: Rows[EdgeTape]
    informations: MatrixStack
    covariances: MatrixStack
    yaws_before: Matrix
    yaws_after: Matrix
    penalties: MatrixStack

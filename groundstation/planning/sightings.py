"""Compiled sightings of all edges in one step of a rollout, for the tape."""

import math

import numpy as np

from groundstation.arrays import Matrix
from groundstation.kernel import kernel
from groundstation.planning.records import COS, SIN, VX, VY, CostProblem, Tape, X, Y, Z
from groundstation.sensing.occlusion import SOFT_M, sight
from groundstation.sensing.visibility import SPREAD, available_at_once, limits_of

_NOTHING = 1e-6  # a smaller availability is not reduced further by boxes


@kernel(inlined=True)
def views_of(problem: CostProblem) -> Matrix:
    """Return the view limits of each edge (15, m) for `available_at_once`; the same in all steps."""
    edges, cameras = problem.edges, problem.cameras
    views = np.empty((15, edges.shape[0]))
    for e in range(edges.shape[0]):
        edge, camera = edges[e], cameras[edges[e].camera]
        limits = limits_of(camera)
        views[0, e], views[1, e] = limits.half_width_tan, limits.half_height_tan
        views[2, e], views[3, e] = limits.across_cos, limits.along_cos
        views[4, e], views[5, e], views[6, e] = limits.up_x, limits.up_y, limits.up_z
        views[7, e], views[8, e], views[9, e] = limits.range_m, limits.border_m, limits.width_m
        views[10, e], views[11, e] = limits.tail_m, limits.caution
        views[12, e], views[13, e] = edge.blur_m2, edge.turn_rad2
        views[14, e] = camera.tail_share if edge.wanted > 0 else 0.0
    return views


@kernel(inlined=True)
def place(problem: CostProblem, tape: Tape, i: int, points: Matrix) -> None:
    """Record each edge's subject relative to its observer, and write it in the camera's frame (3, m) [m]."""
    edges, cameras, targets, markers, path, sightings = (
        problem.edges, problem.cameras, problem.targets, problem.markers, tape.path, tape.sightings
    )  # fmt: skip
    n, m, ahead = path.shape[1], edges.shape[0], (i + 1) * problem.options.step_s
    for e in range(m):
        edge, seen = edges[e], sightings[i * m + e]
        a, b, c, s = edge.observer, edge.subject, 1.0, 0.0
        if b < n:
            x, y, z = path[i + 1, b, X], path[i + 1, b, Y], path[i + 1, b, Z] + markers[b]
        else:
            t = b - n
            x, y, z = targets[t, X] + ahead * targets[t, VX], targets[t, Y] + ahead * targets[t, VY], markers[b]
        if a >= 0:
            x, y, z = x - path[i + 1, a, X], y - path[i + 1, a, Y], z - path[i + 1, a, Z]
            c, s = path[i + 1, a, COS], path[i + 1, a, SIN]
        camera = cameras[edge.camera]
        R, at = camera.rotation, camera.position
        rx, ry, rz = c * x + s * y - at[0], -s * x + c * y - at[1], z - at[2]
        seen.x, seen.y, seen.z, seen.square = x, y, rz, rx * rx + ry * ry + rz * rz
        for axis in range(3):
            points[axis, e] = R[axis, 0] * rx + R[axis, 1] * ry + R[axis, 2] * rz


@kernel(inlined=True)
def record(problem: CostProblem, tape: Tape, i: int, found: Matrix) -> None:
    """Record the availability of each edge, found (4, m), with derivatives turned back into the world."""
    edges, cameras, path, m = problem.edges, problem.cameras, tape.path, problem.edges.shape[0]
    for e in range(m):
        edge, seen, R = edges[e], tape.sightings[i * m + e], cameras[edges[e].camera].rotation
        a_x, a_y, a_z = found[1, e], found[2, e], found[3, e]
        gx = R[0, 0] * a_x + R[1, 0] * a_y + R[2, 0] * a_z
        gy = R[0, 1] * a_x + R[1, 1] * a_y + R[2, 1] * a_z
        seen.a, seen.a_x, seen.a_y, seen.a_yaw = found[0, e], gx, gy, 0.0
        seen.a_z = R[0, 2] * a_x + R[1, 2] * a_y + R[2, 2] * a_z
        if edge.observer >= 0:
            c, s = path[i + 1, edge.observer, COS], path[i + 1, edge.observer, SIN]
            seen.a_x, seen.a_y = c * gx - s * gy, s * gx + c * gy
            seen.a_yaw = seen.a_x * seen.y - seen.a_y * seen.x


@kernel()
def hide(problem: CostProblem, tape: Tape, i: int, e: int) -> None:
    """Reduce the availability of one edge in one step by boxes; it then depends on both positions."""
    edge, seen = problem.edges[e], tape.sightings[i * problem.edges.shape[0] + e]
    seen.along_x = seen.along_y = seen.along_z = 0.0
    if seen.a <= _NOTHING:
        return
    camera, a, c, s, x, y, z = problem.cameras[edge.camera], edge.observer, 1.0, 0.0, 0.0, 0.0, 0.0
    if a >= 0:
        place = tape.path[i + 1, a]
        c, s, x, y, z = place[COS], place[SIN], place[X], place[Y], place[Z]
    off_x, off_y = c * camera.position[0] - s * camera.position[1], s * camera.position[0] + c * camera.position[1]
    z += camera.position[2]
    width = math.sqrt(SOFT_M * SOFT_M + SPREAD * edge.blur_m2)
    free = sight(problem.boxes, width, x + off_x, y + off_y, z, x + seen.x, y + seen.y, z + seen.z)
    seen.along_x, seen.along_y = seen.a * (free.eye_x + free.x), seen.a * (free.eye_y + free.y)
    seen.along_z = seen.a * (free.eye_z + free.z)
    seen.a_x, seen.a_y = free.a * seen.a_x + seen.a * free.x, free.a * seen.a_y + seen.a * free.y
    seen.a_z = free.a * seen.a_z + seen.a * free.z
    if a >= 0:
        seen.a_yaw = free.a * seen.a_yaw + seen.a * (off_x * free.eye_y - off_y * free.eye_x)
    seen.a *= free.a


@kernel(inlined=True)
def look_around(problem: CostProblem, tape: Tape, i: int, views: Matrix, points: Matrix, found: Matrix) -> None:
    """Record in the tape the views of all edges in one step; views: see `views_of`.

    Points (3, m), found (4, m): work.
    """
    place(problem, tape, i, points)
    available_at_once(views, points, found)
    record(problem, tape, i, found)
    if problem.boxes.shape[0] > 0:
        for e in range(problem.edges.shape[0]):
            hide(problem, tape, i, e)

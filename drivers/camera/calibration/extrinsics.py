"""A camera's pose from markers that lie flat at known places: least squares over all corners at once. Pure.

The unknowns are the camera's pose, the scale of all prints, and each marker's small displacement from its stated place:
a tape measure is good to millimetres, and all markers together show which one was put elsewhere, or a printer that
shrank them all.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from drivers.camera.calibration.static_markers import Steady, flat_points
from drivers.camera.pose import planar_poses
from groundstation.arrays import Array
from groundstation.errors import DriverError
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import rotation_z

# Where the shifts and turns of the markers begin among the variables.
_SHIFTS = 7
_YAW_STD_RAD = math.radians(1.0)
_FREE_YAW_STD_RAD = math.pi
_MISPLACED = 4.0
_LEAST_TO_JUDGE = 4
_WORST_RMS_PX = 2.0
# Relative error of the size of prints that somebody checked with a ruler, and one that knows nothing of them.
_PRINT_STD, _FREE_PRINT_STD = 0.003, 0.1
# Printers shrink a page to their margins by 3 to 6 %: beyond that the tape, or the size of the squares, was misread.
_WORST_SCALE = 0.07


@dataclass(frozen=True, slots=True)
class Mark:
    """A marker flat on the floor or a table: code, centre [m], and the direction of its x axis (None: unknown)."""

    code: int
    position_m: tuple[float, float, float]
    yaw_rad: float | None = None


@dataclass(frozen=True, slots=True)
class Placing:
    """frame_from_optical with the covariance (6, 6) of (left rotation error [rad], position [m]), rms [px].

    offsets_m: estimated distance of each marker from its stated place; misplaced: those that were left out.
    scale, scale_std: how much larger all prints are than stated, as a share, and one sigma; layout_scale_std: the sigma
    if the places of the markers alone had to show it.
    """

    pose: Pose
    covariance: Array
    rms_px: float
    offsets_m: dict[int, float]
    scale: float
    scale_std: float
    layout_scale_std: float = math.inf
    misplaced: dict[int, float] = field(default_factory=dict)

    @property
    def position_std_m(self) -> Array:
        """Return one sigma of the position (3) [m]."""
        return np.sqrt(np.diag(self.covariance)[3:])

    @property
    def attitude_std_rad(self) -> Array:
        """Return one sigma of the attitude about the frame's axes (3) [rad]."""
        return np.sqrt(np.diag(self.covariance)[:3])


def place_camera(
    marks: Sequence[Mark], steady: Mapping[int, Steady], lens: CameraIntrinsics, square_mm: float, mark_std_m: float
) -> Placing:
    """Return the camera's pose in the frame in which the marks are given.

    mark_std_m: how precisely they were placed. Raises DriverError, with what is missing, if the sightings do not
    determine it.
    """
    survey = _Survey(steady, lens, square_mm, mark_std_m)
    used = [mark for mark in marks if mark.code in steady]
    misplaced: dict[int, float] = {}
    while True:
        _require_enough(used, marks)
        fit = survey.fit(used, _PRINT_STD)
        worst = max(fit.offsets_m, key=fit.offsets_m.__getitem__)
        if survey.agree(fit) or len(used) < _LEAST_TO_JUDGE:
            break
        others = [mark for mark in used if mark.code != worst]
        scaled = survey.fit(used, _FREE_PRINT_STD, fit)
        if survey.agree(scaled) and scaled.misfit < survey.fit(others, _PRINT_STD).misfit:
            fit = scaled
            break
        misplaced[worst] = fit.offsets_m[worst]
        used = others
    if fit.rms_px > _WORST_RMS_PX:
        raise DriverError(
            f"the corners fit no place of the camera ({fit.rms_px:.1f} px rms): is the calibration this camera's, "
            f"are the squares {square_mm:g} mm, do the markers lie flat?"
        )
    placing = survey.placing(used, fit)
    if not survey.agree(fit) or abs(placing.scale) > _WORST_SCALE:
        offsets = misplaced | fit.offsets_m
        each = ", ".join(f"{code} by {offset_m * 100:.1f} cm" for code, offset_m in sorted(offsets.items()))
        raise DriverError(
            f"the markers do not lie to each other as you said ({each}; {mark_std_m * 100:g} cm is their deviation), "
            f"and they are too few to tell which is wrong: measure all places again; are the squares {square_mm:g} mm?"
        )
    return replace(placing, misplaced=misplaced)


def _require_enough(used: Sequence[Mark], marks: Sequence[Mark]) -> None:
    if not used:
        named = ", ".join(str(mark.code) for mark in marks)
        raise DriverError(f"none of the markers {named} was seen: are they in the picture, flat, lit and large enough?")
    if len(used) == 1 and used[0].yaw_rad is None:
        raise DriverError(
            f"only marker {used[0].code} was seen, and which way it points was not said: give its heading as fourth "
            "number, or lay out a second marker"
        )


@dataclass(frozen=True, slots=True)
class _Fit:
    """One least-squares fit; covariance (7, 7): of the pose as in Placing, and of the scale.

    misfit: squared sigmas by which places, headings and scale deviate from those stated; variables: of the problem.
    """

    pose: Pose
    scale: float
    covariance: Array
    rms_px: float
    offsets_m: dict[int, float]
    misfit: float
    variables: Array


@dataclass(frozen=True, slots=True)
class _Survey:
    """The sightings of all markers, the lens, and how precisely the markers were placed."""

    steady: Mapping[int, Steady]
    lens: CameraIntrinsics
    square_mm: float
    mark_std_m: float

    def fit(self, marks: Sequence[Mark], print_std: float, near: _Fit | None = None) -> _Fit:
        """Return the likeliest pose if the size of prints is known this well; near: another fit of these markers."""
        problem = _Problem(marks, self, print_std)
        starts = problem.starts() if near is None else [near.variables]
        solutions = [least_squares(problem.residuals, start, x_scale="jac", max_nfev=60) for start in starts]
        if not solutions:
            raise DriverError("no pose comes of the corners: is the calibration this camera's?")
        best = min(solutions, key=lambda solution: float(solution.cost))
        pixels, priors = np.split(best.fun, [problem.pixel_rows])
        freedom = max(1, len(best.fun) - len(best.x))
        inflation = max(1.0, 2.0 * float(best.cost) / freedom)
        information = best.jac.T @ best.jac
        covariance = inflation * np.linalg.solve(information, np.eye(len(best.x)))[:_SHIFTS, :_SHIFTS]
        offsets = {m.code: float(np.hypot(*best.x[_SHIFTS + 3 * i :][:2])) for i, m in enumerate(marks)}
        rms = float(np.sqrt((pixels**2).mean() * 2.0)) * problem.sigma_px
        pose, misfit = problem.pose_of(best.x), float((priors**2).sum())
        return _Fit(pose, float(best.x[6]), np.asarray(covariance), rms, offsets, misfit, best.x)

    def agree(self, fit: _Fit) -> bool:
        """Return whether all markers lie about where they were said to, and have about the stated size."""
        return max(fit.offsets_m.values()) <= _MISPLACED * self.mark_std_m and abs(fit.scale) <= _WORST_SCALE

    def placing(self, marks: Sequence[Mark], near: _Fit) -> Placing:
        """Return the result from these markers.

        Where their places contradict the size of their prints, that size counts as less well known, as far as it takes
        to agree; and the deviations cover the pose by the stated size as well, as the places may be what is wrong.
        """
        stated, free = self.fit(marks, _PRINT_STD, near), self.fit(marks, _FREE_PRINT_STD, near)
        excess = free.scale**2 - free.covariance[6, 6]
        print_std = math.sqrt(max(_PRINT_STD**2, excess))
        fit = self.fit(marks, print_std, free) if print_std > _PRINT_STD else stated
        apart = np.append(
            vector_of_rotation(fit.pose.rotation @ stated.pose.rotation.T),
            [*(fit.pose.translation - stated.pose.translation), fit.scale - stated.scale],
        )
        covariance = fit.covariance + np.outer(apart, apart)
        scale_std, layout_std = math.sqrt(covariance[6, 6]), math.sqrt(free.covariance[6, 6])
        return Placing(fit.pose, covariance[:6, :6], fit.rms_px, fit.offsets_m, fit.scale, scale_std, layout_std)


class _Problem:
    """Residuals of all corners in sigmas, then those of the prints' scale and of the markers' places and headings.

    Variables: rotation vector (left of the start) and position of the camera; scale of the prints; by marker a shift
    along x and y, a turn.
    """

    def __init__(self, marks: Sequence[Mark], survey: _Survey, print_std: float) -> None:
        self._marks, self._lens, self._std_m, self._print_std = marks, survey.lens, survey.mark_std_m, print_std
        self._points = flat_points(survey.square_mm)
        self._corners = [survey.steady[mark.code].corners for mark in marks]
        noise = max(survey.steady[mark.code].std_px for mark in marks)
        # The lens explains its own calibration board only to its residual: the rest does not average out.
        self.sigma_px = math.hypot(noise, max(self._lens.residual_px, 0.05))
        self.pixel_rows = 24 * len(marks)
        self._yaws = [0.0 if mark.yaw_rad is None else mark.yaw_rad for mark in marks]

    def pose_of(self, x: Array) -> Pose:
        """Return frame_from_optical."""
        return Pose(rotation_of_vector(x[:3]), x[3:6])

    def residuals(self, x: Array) -> Array:
        """Return all residuals [sigmas]."""
        pose = self.pose_of(x).inverse()
        rows: list[Array] = []
        priors: list[float] = [x[6] / self._print_std]
        for index, (mark, corners) in enumerate(zip(self._marks, self._corners, strict=True)):
            dx, dy, turn = x[_SHIFTS + 3 * index :][:3]
            place = np.add(mark.position_m, (dx, dy, 0.0))
            points = (1.0 + x[6]) * self._points @ rotation_z(self._yaws[index] + turn).T + place
            seen = self._lens.project(pose.apply(points))
            rows.append(np.nan_to_num((seen - corners) / self.sigma_px, nan=1e4).ravel())
            yaw_std = _FREE_YAW_STD_RAD if mark.yaw_rad is None else _YAW_STD_RAD
            priors += [dx / self._std_m, dy / self._std_m, turn / yaw_std]
        return np.concatenate([*rows, np.array(priors)])

    def starts(self) -> list[Array]:
        """Return first guesses: from the pose of one marker, both solutions, and the places of the others."""
        poses = [planar_poses(corners, self._points, self._lens) for corners in self._corners]
        first = next((i for i, mark in enumerate(self._marks) if mark.yaw_rad is not None and poses[i]), 0)
        if any(not many for many in poses):
            return []
        starts = []
        for solution in poses[first]:
            marker_from_optical = Pose(solution.rotation, solution.translation).inverse()
            centres = np.array([marker_from_optical.apply(many[0].translation)[:2] for many in poses])
            yaw = self._heading(first, centres)
            place = Pose(rotation_z(yaw), np.array(self._marks[first].position_m))
            camera = place.compose(marker_from_optical)
            x = np.zeros(_SHIFTS + 3 * len(self._marks))
            x[:3], x[3:6] = vector_of_rotation(camera.rotation), camera.translation
            for index, mark in enumerate(self._marks):
                if mark.yaw_rad is None:
                    turned = camera.rotation @ poses[index][0].rotation
                    x[_SHIFTS + 3 * index + 2] = math.atan2(turned[1, 0], turned[0, 0])
            starts.append(x)
        return starts

    def _heading(self, first: int, centres: Array) -> float:
        """Return the heading of the first marker: the stated one, else that implied by the places of the others."""
        said = self._marks[first].yaw_rad
        if said is not None:
            return said
        places = np.array([mark.position_m[:2] for mark in self._marks])
        a, b = centres - centres.mean(axis=0), places - places.mean(axis=0)
        return math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum()))


def rotation_of_vector(vector: Array) -> Array:
    """Return the rotation (3, 3) about a vector by its length [rad]."""
    return np.asarray(Rotation.from_rotvec(vector).as_matrix())


def vector_of_rotation(rotation: Array) -> Array:
    """Return the rotation vector (3) [rad] of a rotation matrix."""
    return np.asarray(Rotation.from_matrix(rotation).as_rotvec())

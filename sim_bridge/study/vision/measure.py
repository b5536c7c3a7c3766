"""Measures the detector on pictures with known truth: detection rate, pose error, consistency, identity, CPU time."""

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import cv2
import numpy as np

from drivers.camera import pose
from drivers.camera.convert import stabilized_from_optical
from drivers.camera.detect import Find, find_board, refined, spacing_px
from drivers.camera.markers import read_bar
from drivers.camera.prediction import Foresight, Prediction
from drivers.camera.search import find_in, search
from drivers.camera.settings import DetectorSettings, MarkerKind, MarkerSettings, MountSettings
from drivers.camera.tracks import Track
from groundstation.arrays import Array
from groundstation.bus.messages import EntityEstimate, Estimate, Header
from groundstation.geometry.angles import wrap
from sim_bridge.study.vision.scenes import FRONT, SQUARE_MM, TILT_DOWN_DEG, TestPicture, points

_RIGHT_PX = 3.0
_FRAME_NS = 66_666_667
_MOUNT = MountSettings(parent="drone_1", tilt_down_deg=TILT_DOWN_DEG)
# A belief as the estimator has it in flight, and attitudes as vehicles report them.
_BELIEF_STD_M, _YAW_STD_RAD, _ATTITUDE_STD_RAD = 0.05, 0.02, math.radians(2.0)
_DETECTOR = DetectorSettings()


def cpu_ms(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the CPU time of one call [ms], and its result."""
    begin = time.process_time()
    result = work()
    return 1000.0 * (time.process_time() - begin), result


def predicted(shot: TestPicture, random: np.random.Generator) -> tuple[Prediction | None, tuple[float, float]]:
    """Return the board's place expected by a noisy belief, and the observer's measured roll and pitch."""
    robot, centre = shot.states[0], shot.centre
    # The bench lifts boards off the floor to keep their distance: their height is known, their place is not.
    place = (0.0, 0.0, float(centre[2]))
    marker = MarkerSettings(entity="bot", code=shot.code, square_mm=SQUARE_MM, position_m=place, kind=MarkerKind.TARGET)
    carrier_m = robot[:3] + random.normal(0.0, _BELIEF_STD_M, 3)
    mean = (*carrier_m.tolist(), float(robot[8] + random.normal(0.0, _YAW_STD_RAD)))
    carrier = np.diag([_BELIEF_STD_M**2] * 3 + [_YAW_STD_RAD**2])
    bot = centre[:2] + random.normal(0.0, _BELIEF_STD_M, 2)
    flat = (_BELIEF_STD_M**2, 0.0, 0.0, _BELIEF_STD_M**2)
    estimate = Estimate(
        header=Header(0, "bench", "tracker", "tracker", 0),
        entities=(
            EntityEstimate("drone_1", "robot", mean, tuple(carrier.ravel().tolist()), (0.0, 0.0, 0.0), True, 0.1),
            EntityEstimate("bot", "target", (float(bot[0]), float(bot[1])), flat, (0.0, 0.0), True, 0.1),
        ),
        epoch=1,
    )
    roll, pitch = (float(angle + random.normal(0.0, _ATTITUDE_STD_RAD)) for angle in robot[6:8])
    foresight = Foresight(_MOUNT, "drone_1", (marker,), FRONT)
    foresight.add(estimate)
    return foresight.at(0, (roll, pitch)).get("bot"), (roll, pitch)


@dataclass
class DetectionTally:
    """Results of several pictures; lists hold one figure for each board that was followed.

    followed: found in the window of a track; acquired: in the window of a cold belief; searched: in the whole picture.
    """

    pictures: int = 0
    followed: int = 0
    acquired: int = 0
    searched: int = 0
    sure: int = 0
    wrong_ids: int = 0
    flips: int = 0
    corner_px: list[float] = field(default_factory=list)
    range_mm: list[float] = field(default_factory=list)
    heading_deg: list[float] = field(default_factory=list)
    nees_6: list[float] = field(default_factory=list)
    nees_4: list[float] = field(default_factory=list)
    window_ms: list[float] = field(default_factory=list)
    acquire_ms: list[float] = field(default_factory=list)
    search_ms: list[float] = field(default_factory=list)

    def row(self) -> dict[str, float | int | None]:
        """Return the figures of these pictures."""
        return {
            "pictures": self.pictures,
            **{
                name: count / self.pictures if self.pictures else None
                for name, count in (
                    ("followed", self.followed),
                    ("identified", self.sure),
                    *((("acquired", self.acquired), ("searched", self.searched)) if self.search_ms else ()),
                )
            },
            "wrong_ids": self.wrong_ids,
            "flips": self.flips,
            "corner_rms_px": _of(self.corner_px, lambda v: math.sqrt(float(np.mean(np.square(v))))),
            "range_error_median_mm": _of(self.range_mm, np.median),
            "heading_error_median_deg": _of(self.heading_deg, np.median),
            "anees_6": _of(self.nees_6, np.mean),
            "anees_4": _of(self.nees_4, np.mean),
            "window_ms": _of(self.window_ms, np.median),
            "acquire_ms": _of(self.acquire_ms, np.median),
            "search_ms": _of(self.search_ms, np.median),
        }


def _of(values: list[float], statistic: Callable[[list[float]], Any]) -> float | None:
    return float(statistic(values)) if values else None


def measured(shots: Iterable[TestPicture], seed: int, searching: bool = True) -> DetectionTally:
    """Return the detector's results on pictures: in a track's window, in a cold belief's, and searching all."""
    random, tally = np.random.default_rng(seed), DetectionTally()
    for shot in shots:
        tally.pictures += 1
        prediction, attitude = predicted(shot, random)
        _follow(tally, shot, random, attitude)
        if not searching:
            continue
        window = prediction.window(shot.picture.shape) if prediction is not None else None
        if prediction is not None and window is not None:
            ms, find = cpu_ms(partial(find_in, shot.picture, window, prediction.spacing_px, []))
            tally.acquire_ms.append(ms)
            tally.acquired += _is_right(find, shot)
        ms, finds = cpu_ms(partial(search, shot.picture, []))
        tally.search_ms.append(ms)
        tally.searched += any(_is_right(find, shot) for find in finds)
    return tally


def _follow(
    tally: DetectionTally, shot: TestPicture, random: np.random.Generator, attitude: tuple[float, float]
) -> None:
    """Search where a track of the last picture expects the board: a few pixels off, its size 15 % wrong."""
    centre = shot.corners.mean(axis=0)
    last = centre + (shot.corners - centre) * random.uniform(0.87, 1.15) + random.uniform(-6.0, 6.0, 2)
    track = Track(last, -_FRAME_NS)
    window = track.window(0, shot.picture.shape)
    if window is None:
        return
    ms, find = cpu_ms(partial(find_board, shot.picture, window, spacing_px(last)))
    tally.window_ms.append(ms)
    if find is not None and _is_right(find, shot):
        tally.followed += 1
        _judge(tally, shot, find, attitude)


def _is_right(find: Find | None, shot: TestPicture) -> bool:
    return find is not None and float(np.abs(find.corners - shot.corners).max()) < _RIGHT_PX


def _judge(tally: DetectionTally, shot: TestPicture, find: Find, attitude: tuple[float, float]) -> None:
    reading = read_bar(shot.picture, find, FRONT)
    if reading is not None and reading.is_sure(_DETECTOR.identity_margin):
        tally.sure += 1
        tally.wrong_ids += reading.code != shot.code
    tally.corner_px += (find.corners - shot.corners).ravel().tolist()
    rotation = stabilized_from_optical(_MOUNT, *attitude)
    gravity = pose.Gravity(rotation, float(shot.states[1, 6]), float(shot.states[1, 7]), True)
    poses = pose.planar_poses(find.corners, points(), FRONT)
    choice = pose.choose(poses, points(), FRONT, gravity, _DETECTOR.corner_floor_px, _DETECTOR.ambiguity_cost)
    best = min(poses, key=lambda p: float(np.abs(p.translation - choice.best.position_m).max()))
    gap = best.translation - shot.truth.translation
    turn = _rotation_vector(best.rotation @ shot.truth.rotation.T)
    if float(np.linalg.norm(turn)) > math.radians(10.0):
        # The other planar solution, or a board so small that this is within its covariance.
        tally.flips += _is_flip(turn, best)
    covariance = pose.pose_covariance(best, points(), FRONT, _DETECTOR.corner_floor_px)
    error = np.concatenate((turn, gap))
    tally.nees_6.append(float(error @ np.linalg.solve(covariance, error)) / 6.0)
    exact = stabilized_from_optical(_MOUNT, float(shot.states[0, 6]), float(shot.states[0, 7]))
    axis, seen = exact @ shot.truth.rotation[:, 0], exact @ best.rotation[:, 0]
    heading = wrap(math.atan2(seen[1], seen[0]) - math.atan2(axis[1], axis[0]))
    error_4 = np.append(gap, heading)
    tally.nees_4.append(float(error_4 @ np.linalg.solve(choice.best.covariance, error_4)) / 4.0)
    distance = np.linalg.norm(shot.truth.translation)
    tally.range_mm.append(abs(float(np.linalg.norm(best.translation) - distance)) * 1000.0)
    tally.heading_deg.append(abs(math.degrees(heading)))


def _is_flip(turn: Array, best: pose.PlanarPose) -> bool:
    spread = pose.pose_covariance(best, points(), FRONT, _DETECTOR.corner_floor_px)[:3, :3]
    return float(turn @ np.linalg.solve(spread, turn)) > 30.0


def _rotation_vector(rotation: Array) -> Array:
    return np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64).ravel()


def peer_search(shot: TestPicture) -> bool:
    """Return whether OpenCV's sector-based finder sees the board in the whole picture (its corners refined)."""
    found, corners = cv2.findChessboardCornersSB(shot.picture, (4, 3))
    if not found or corners is None:
        return False
    fine = refined(shot.picture, np.asarray(corners, dtype=np.float64).reshape(-1, 2))
    distance = np.linalg.norm(fine[:, None] - shot.corners[None], axis=-1).min(axis=0)
    return bool(distance.max() < _RIGHT_PX)

"""Turns the true states of all bodies into the scene before one camera."""

import math
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import rotation_from_euler
from sim_bridge.render.spec import BoardSpec, RenderSpec

# No point of a body is farther from its base. (A board is not drawn if its middle is behind the camera.)
_REACH_M = 1.0
_POSITION, _VELOCITY, _ATTITUDE, _RATES = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)


def world_from_base(state: Array) -> Pose:
    """Return a body's pose from its row of the truth board."""
    return Pose(rotation_from_euler(*state[_ATTITUDE]), state[_POSITION])


def moved(base: Pose, state: Array, seconds: float) -> Pose:
    """Return the pose of a body (world_from_base, row) some seconds later, at constant velocity and body rates."""
    turn = state[_RATES] * seconds
    small = np.array([[1.0, -turn[2], turn[1]], [turn[2], 1.0, -turn[0]], [-turn[1], turn[0], 1.0]])
    return Pose(base.rotation @ small, base.translation + state[_VELOCITY] * seconds)


@dataclass(frozen=True, slots=True)
class Sight:
    """One board before the camera: poses in the middle of the exposure.

    begin_m, end_m: its middle [m; camera_optical] at begin and end of the exposure, for the smear. rolling:
    optical_from_marker when the first and the last row are exposed; None when all rows are at once.
    """

    board: BoardSpec
    optical_from_base: Pose
    optical_from_marker: Pose
    begin_m: Array
    end_m: Array
    rolling: tuple[Pose, Pose] | None = None

    @property
    def depth_m(self) -> float:
        """Return the distance along the optical axis."""
        return float(self.optical_from_marker.translation[2])


@dataclass(frozen=True, slots=True)
class CameraScene:
    """A camera pose and the boards before it, farthest first; `rolling` as in Sight, `smear` as begin and end."""

    world_from_optical: Pose
    sights: tuple[Sight, ...]
    smear: tuple[Pose, Pose]
    rolling: tuple[Pose, Pose] | None = None


@dataclass(frozen=True, slots=True)
class _Exposure:
    """A camera's poses (world_from_optical) during an exposure: in the middle, at begin and end (smear).

    rolling: when the first and the last row are exposed; None when all rows are at once. half_s, readout_s: half of the
    exposure and of the readout [s].
    """

    half_s: float
    readout_s: float
    middle: Pose
    smear: tuple[Pose, Pose]
    rolling: tuple[Pose, Pose] | None


def compose_scene(spec: RenderSpec, states: Array) -> CameraScene:
    """Return the scene before the camera, without its own carrier, bodies behind it, and those of unknown place."""
    exposure = _exposure(spec, states)
    optical_from_world = exposure.middle.inverse()
    sights = []
    for board in spec.boards:
        state = states[spec.bodies.index(board.body)]
        if board.body == spec.mount.body or math.isnan(state[0]):
            continue
        sight = _sight(board, state, exposure, optical_from_world)
        if sight is not None:
            sights.append(sight)
    farthest_first = tuple(sorted(sights, key=lambda sight: -sight.depth_m))
    return CameraScene(exposure.middle, farthest_first, exposure.smear, exposure.rolling)


def _exposure(spec: RenderSpec, states: Array) -> _Exposure:
    half_s, readout_s = spec.scenario.exposure_ms / 2000.0, spec.scenario.rolling_shutter_ms / 2000.0
    middle, begin, end = _camera_poses(spec, states, (0.0, -half_s, half_s))
    rolling = None
    if readout_s:
        first, last = _camera_poses(spec, states, (-readout_s, readout_s))
        rolling = first, last
    return _Exposure(half_s, readout_s, middle, (begin, end), rolling)


def _sight(board: BoardSpec, state: Array, exposure: _Exposure, optical_from_world: Pose) -> Sight | None:
    """Return a board in the picture; None if its body is behind the camera."""
    base, offset = world_from_base(state), np.array(board.position_m)
    optical_from_base = optical_from_world.compose(base)
    optical_from_marker = _shifted(optical_from_base, offset)
    if max(optical_from_base.translation[2], optical_from_marker.translation[2]) < -_REACH_M:
        return None
    place = base.apply(offset)
    velocity = base.rotation @ _across(state[_RATES], offset) + state[_VELOCITY]
    begin, end = (
        (place + seconds * velocity - at.translation) @ at.rotation
        for at, seconds in zip(exposure.smear, (-exposure.half_s, exposure.half_s), strict=True)
    )
    rows = None
    if exposure.rolling is not None:
        first, last = (
            _shifted(at.inverse().compose(moved(base, state, seconds)), offset)
            for at, seconds in zip(exposure.rolling, (-exposure.readout_s, exposure.readout_s), strict=True)
        )
        rows = first, last
    return Sight(board, optical_from_base, optical_from_marker, begin, end, rows)


def _shifted(pose: Pose, offset: Array) -> Pose:
    """Return a pose whose origin is at an offset of its own."""
    return Pose(pose.rotation, pose.apply(offset))


def _across(rates: Array, point: Array) -> Array:
    """Return the velocity of a point of a turning body [base]."""
    (wx, wy, wz), (x, y, z) = rates.tolist(), point.tolist()
    return np.array([wy * z - wz * y, wz * x - wx * z, wx * y - wy * x])


def _camera_poses(spec: RenderSpec, states: Array, moments_s: tuple[float, ...]) -> tuple[Pose, ...]:
    """Return world_from_camera_optical at moments after the states' time [s]."""
    mount = spec.mount
    if not mount.body:
        return (mount.parent_from_optical,) * len(moments_s)
    state = states[spec.bodies.index(mount.body)]
    base = world_from_base(state)
    bases = (moved(base, state, seconds) if seconds else base for seconds in moments_s)
    return tuple(one.compose(mount.parent_from_optical) for one in bases)

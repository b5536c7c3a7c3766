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
    """One board before the camera: poses at mid exposure, and at its begin and end for the smear.

    rolling: optical_from_marker when the first and the last row are exposed; None when all rows are at once.
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


def compose_scene(spec: RenderSpec, states: Array) -> CameraScene:
    """Return the scene before the camera, without its own carrier, bodies behind it, and those of unknown place."""
    half_s, readout_s = spec.scenario.exposure_ms / 2000.0, spec.scenario.rolling_shutter_ms / 2000.0
    camera, *smear = _camera_poses(spec, states, (0.0, -half_s, half_s))
    rolling = None
    if readout_s:
        first, last = _camera_poses(spec, states, (-readout_s, readout_s))
        rolling = first, last
    optical_from_world = camera.inverse()
    sights = []
    for board in spec.boards:
        state = states[spec.bodies.index(board.body)]
        if board.body == spec.mount.body or math.isnan(state[0]):
            continue
        base, offset = world_from_base(state), np.array(board.position_m)
        optical_from_base = optical_from_world.compose(base)
        optical_from_marker = _shifted(optical_from_base, offset)
        if max(optical_from_base.translation[2], optical_from_marker.translation[2]) < -_REACH_M:
            continue
        place = base.apply(offset)
        velocity = base.rotation @ _across(state[_RATES], offset) + state[_VELOCITY]
        begin, end = (
            (place + seconds * velocity - at.translation) @ at.rotation
            for at, seconds in zip(smear, (-half_s, half_s), strict=True)
        )
        rows = None
        if rolling is not None:
            first, last = (
                _shifted(at.inverse().compose(moved(base, state, seconds)), offset)
                for at, seconds in zip(rolling, (-readout_s, readout_s), strict=True)
            )
            rows = first, last
        sights.append(Sight(board, optical_from_base, optical_from_marker, begin, end, rows))
    farthest_first = tuple(sorted(sights, key=lambda sight: -sight.depth_m))
    return CameraScene(camera, farthest_first, (smear[0], smear[1]), rolling)


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

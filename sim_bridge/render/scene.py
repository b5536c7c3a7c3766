"""From the true states of all bodies to what one camera has before it."""

import math
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import rotation_from_euler
from sim_bridge.render.spec import BoardSpec, Mount, RenderSpec

_POSITION, _VELOCITY, _ATTITUDE, _RATES = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)


def world_from_base(state: Array) -> Pose:
    """Return a body's pose from its row of the truth board."""
    return Pose(rotation_from_euler(*state[_ATTITUDE]), state[_POSITION])


def moved(state: Array, seconds: float) -> Pose:
    """Return the pose a body has a moment later, at constant velocity and body rates."""
    pose = world_from_base(state)
    turn = state[_RATES] * seconds
    small = np.array([[1.0, -turn[2], turn[1]], [turn[2], 1.0, -turn[0]], [-turn[1], turn[0], 1.0]])
    return Pose(pose.rotation @ small, pose.translation + state[_VELOCITY] * seconds)


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


def camera_pose(mount: Mount, bodies: tuple[str, ...], states: Array) -> Pose:
    """Return world_from_camera_optical."""
    if not mount.body:
        return mount.parent_from_optical
    return world_from_base(states[bodies.index(mount.body)]).compose(mount.parent_from_optical)


def compose_scene(spec: RenderSpec, states: Array) -> CameraScene:
    """Return what the camera has before it; a camera never sees its own carrier, nor what is nowhere (NaN)."""
    half_s, readout_s = spec.scenario.exposure_ms / 2000.0, spec.scenario.rolling_shutter_ms / 2000.0
    camera = camera_pose(spec.mount, spec.bodies, states)
    optical_from_world = camera.inverse()
    smear = _camera_moved(spec, states, -half_s), _camera_moved(spec, states, half_s)
    rolling = (_camera_moved(spec, states, -readout_s), _camera_moved(spec, states, readout_s)) if readout_s else None
    sights = []
    for board in spec.boards:
        if board.body == spec.mount.body:
            continue
        state, offset = states[spec.bodies.index(board.body)], np.array(board.position_m)
        if math.isnan(state[0]):
            continue
        base = world_from_base(state)
        optical_from_base = optical_from_world.compose(base)
        on_body = Pose(np.eye(3), offset)
        begin, end = (
            (_point_moved(state, base, offset, seconds) - at.translation) @ at.rotation
            for at, seconds in zip(smear, (-half_s, half_s), strict=True)
        )
        rows = None
        if rolling is not None:
            first, last = (
                at.inverse().compose(moved(state, seconds).compose(on_body))
                for at, seconds in zip(rolling, (-readout_s, readout_s), strict=True)
            )
            rows = first, last
        sights.append(Sight(board, optical_from_base, optical_from_base.compose(on_body), begin, end, rows))
    return CameraScene(camera, tuple(sorted(sights, key=lambda sight: -sight.depth_m)), smear, rolling)


def _point_moved(state: Array, base: Pose, point: Array, seconds: float) -> Array:
    """Return where a point of a body is a moment later [m; world]."""
    turned = point + seconds * np.array(
        [
            state[10] * point[2] - state[11] * point[1],
            state[11] * point[0] - state[9] * point[2],
            state[9] * point[1] - state[10] * point[0],
        ]
    )
    return np.asarray(base.rotation @ turned + base.translation + seconds * state[_VELOCITY])


def _camera_moved(spec: RenderSpec, states: Array, seconds: float) -> Pose:
    if not spec.mount.body:
        return spec.mount.parent_from_optical
    return moved(states[spec.bodies.index(spec.mount.body)], seconds).compose(spec.mount.parent_from_optical)

"""From the true states of all bodies to what one camera has before it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import rotation_from_euler
from sim_bridge.render.spec import BoardSpec, Mount, RenderSpec

Array = NDArray[np.float64]
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
    """One board before the camera: poses at mid exposure, and at its begin and end for the smear."""

    board: BoardSpec
    optical_from_base: Pose
    optical_from_marker: Pose
    begin_m: Array
    end_m: Array

    @property
    def depth_m(self) -> float:
        """Return the distance along the optical axis."""
        return float(self.optical_from_marker.translation[2])


@dataclass(frozen=True, slots=True)
class Scene:
    """A camera pose and the boards before it, farthest first."""

    world_from_optical: Pose
    sights: tuple[Sight, ...]


def camera_pose(mount: Mount, bodies: tuple[str, ...], states: Array) -> Pose:
    """Return world_from_camera_optical."""
    if not mount.body:
        return mount.parent_from_optical
    return world_from_base(states[bodies.index(mount.body)]).compose(mount.parent_from_optical)


def compose_scene(spec: RenderSpec, states: Array) -> Scene:
    """Return what the camera has before it; a camera never sees its own carrier."""
    half_s = spec.scenario.exposure_ms / 2000.0
    camera = camera_pose(spec.mount, spec.bodies, states)
    moments = [(_camera_moved(spec, states, seconds), seconds) for seconds in (-half_s, half_s)]
    sights = []
    for board in spec.boards:
        if board.body == spec.mount.body:
            continue
        state = states[spec.bodies.index(board.body)]
        optical_from_base = camera.inverse().compose(world_from_base(state))
        on_body = Pose(np.eye(3), np.array(board.position_m))
        begin, end = (at.inverse().compose(moved(state, seconds)).apply(on_body.translation) for at, seconds in moments)
        sights.append(Sight(board, optical_from_base, optical_from_base.compose(on_body), begin, end))
    return Scene(camera, tuple(sorted(sights, key=lambda sight: -sight.depth_m)))


def _camera_moved(spec: RenderSpec, states: Array, seconds: float) -> Pose:
    if not spec.mount.body:
        return spec.mount.parent_from_optical
    return moved(states[spec.bodies.index(spec.mount.body)], seconds).compose(spec.mount.parent_from_optical)

"""Frames of an emulated motion capture system, for any wire: true poses with its noise and its faults."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.angles import quaternion_from_euler, quaternion_product
from groundstation.geometry.rotations import rotation_from_euler, rotation_x, rotation_z
from sim_bridge.fault_kinds import Fault, FaultKind, standing
from sim_bridge.mounting import surveyed
from sim_bridge.site import SiteBody, SiteCapture

FRAME_TICKS = 2  # 100 frames a second
TICK_S = 0.005


@dataclass(frozen=True, slots=True)
class SeenBody:
    """One body of a frame, in the system's axes: name, place [m], quaternion (x, y, z, w), whether it is tracked."""

    name: str
    place: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    inside: bool


class CapturedBodies:
    """The frames of one system.

    states: returns a row for each body, as `World.states` has them; errors: whether its axes are a little off.
    """

    def __init__(
        self, name: str, system: SiteCapture, bodies: Iterable[str], states: Callable[[], Array],
        rng: np.random.Generator, faults: Iterable[Fault] = (), errors: bool = True,
    ) -> None:  # fmt: skip
        self.system, self._name, self._states, self._rng = system, name, states, rng
        self._bodies = tuple(bodies)
        self._faults = tuple(faults)
        upright = rotation_x(math.pi / 2) if system.up == "y" else np.eye(3)
        axes_from_world = (rotation_z(math.radians(system.yaw_deg)) @ upright).T
        rotation, origin = surveyed(system, errors, rng)
        self._turn = axes_from_world @ rotation.T
        self._shift = self._turn @ origin + axes_from_world @ np.array(system.position_m)
        self._turn_wxyz = quaternion_of(self._turn)
        self._body_wxyz = {
            entity: quaternion_of(rotation_z(math.radians(self._body(entity).yaw_deg)) @ upright)
            for entity in self._bodies
        }
        self._last: tuple[SeenBody, ...] | None = None

    @property
    def names(self) -> list[str]:
        """Return the names of all bodies in the system."""
        return [self._body(entity).name or entity for entity in self._bodies]

    def is_silent(self, now_s: float) -> bool:
        """Return whether a fault withholds its frames."""
        return standing(self._faults, FaultKind.CAPTURE_SILENT, now_s, self._name) is not None

    def frame(self, now_s: float) -> tuple[SeenBody, ...]:
        """Return the present frame; under the fault "frozen" the last one."""
        if self._last is not None and standing(self._faults, FaultKind.CAPTURE_FROZEN, now_s, self._name) is not None:
            return self._last
        at = dict(zip(self._bodies, self._states(), strict=True))
        swapped = standing(self._faults, FaultKind.BODIES_SWAPPED, now_s)
        if swapped is not None and swapped.other is not None:
            at[swapped.entity], at[swapped.other] = at[swapped.other], at[swapped.entity]
        self._last = tuple(self._seen(entity, row, now_s) for entity, row in at.items() if not math.isnan(row[0]))
        return self._last

    def _seen(self, entity: str, row: Array, now_s: float) -> SeenBody:
        """Return the rigid body on an entity from the entity's true state."""
        body, noise = self._body(entity), self._rng.standard_normal(6)
        place_std, turn_std = self.system.pose_std_m, math.radians(self.system.heading_std_deg)
        attitude = (row[6:9] + turn_std * noise[3:]).tolist()
        origin = row[:3] + place_std * noise[:3]
        if any(body.position_m):
            origin += rotation_from_euler(*attitude) @ np.array(body.position_m)
        jumped = standing(self._faults, FaultKind.BODY_JUMPED, now_s, entity)
        if jumped is not None:
            origin[0] += jumped.amount
        x, y, z = (self._turn @ origin - self._shift).tolist()
        turned = standing(self._faults, FaultKind.BODY_TURNED, now_s, entity)
        if turned is not None:
            attitude[2] += math.radians(turned.amount)
        base_wxyz = quaternion_product(quaternion_from_euler(*attitude), self._body_wxyz[entity])
        qw, qx, qy, qz = quaternion_product(self._turn_wxyz, base_wxyz)
        box = self.system.volume_m
        spans = zip(row[:3].tolist(), (box.x_m, box.y_m, box.z_m), strict=True)
        inside = all(low <= value <= high for value, (low, high) in spans)
        sign = math.copysign(1.0, qw)
        return SeenBody(body.name or entity, (x, y, z), (sign * qx, sign * qy, sign * qz, sign * qw), inside)

    def _body(self, entity: str) -> SiteBody:
        return self.system.bodies.get(entity, SiteBody())


def quaternion_of(rotation: Array) -> tuple[float, float, float, float]:
    """Return (w, x, y, z) of a rotation (3, 3), by the eigenvector of its largest eigenvalue (Bar-Itzhack 2000)."""
    r = rotation
    K = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    x, y, z, w = np.linalg.eigh(K)[1][:, -1].tolist()
    return w, x, y, z

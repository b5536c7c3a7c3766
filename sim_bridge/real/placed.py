"""Maps the local frame of a firmware's simulator to the room: the vehicle starts on its pad."""

import math
from dataclasses import dataclass, replace

from groundstation.vectors import Vector3
from sim_bridge.world.airframe import STANDING_HEIGHT_M
from sim_bridge.world.puppet import OutsidePose

_WANDERS_M = 0.5


@dataclass(frozen=True, slots=True)
class TrueState:
    """A simulator's true state: position [m], velocity [m/s; north-east-down], roll, pitch, yaw [rad; FRD], rates.

    grain_m: step of its horizontal position.
    """

    position: Vector3
    velocity: Vector3
    attitude: Vector3
    rates: Vector3
    grain_m: float = 0.0


class Placement:
    """Maps true states to poses in the room; the first one is that of the vehicle on its pad, heading included."""

    def __init__(self, pad_m: tuple[float, float], pad_yaw_rad: float) -> None:
        self._pad_m, self._pad_yaw = pad_m, pad_yaw_rad
        self._first: TrueState | None = None
        self._last: TrueState | None = None

    def go_on_from(self, state: TrueState) -> None:
        """Continue with a state in another frame, such as a globe's: the vehicle is still at its last pose.

        A vehicle that seems to have moved a little still stands on its pad: its own estimate wandered.
        """
        if self._first is None or self._last is None:
            return
        moved = [a - b for a, b in zip(self._last.position, self._first.position, strict=True)]
        if math.hypot(*moved) < _WANDERS_M:
            self._first = None
            return
        north, east, down = (a - b for a, b in zip(state.position, moved, strict=True))
        turned = state.attitude[2] - self._last.attitude[2] + self._first.attitude[2]
        attitude = (*self._first.attitude[:2], turned)
        self._first = replace(self._first, position=(north, east, down), attitude=attitude)

    def pose(self, state: TrueState) -> OutsidePose:
        """Return the pose in the room [world, FLU]."""
        first = self._first = self._first or state
        self._last = state
        turn = self._pad_yaw + first.attitude[2]
        north, east, down = (a - b for a, b in zip(state.position, first.position, strict=True))
        x, y = _turned(north, -east, turn)
        vx, vy = _turned(state.velocity[0], -state.velocity[1], turn)
        roll, pitch, yaw = state.attitude
        p, q, r = state.rates
        return OutsidePose(
            (self._pad_m[0] + x, self._pad_m[1] + y, STANDING_HEIGHT_M - down),
            (vx, vy, -state.velocity[2]),
            (roll, -pitch, math.remainder(turn - yaw, math.tau)),
            (p, -q, -r),
            state.grain_m,
        )


def _turned(x: float, y: float, angle: float) -> tuple[float, float]:
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y

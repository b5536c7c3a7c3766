"""From the local frame of a firmware's simulator to the room: it starts on the vehicle's pad, as the field says."""

import math
from dataclasses import dataclass

from sim_bridge.world.ardrone_airframe import STANDING_HEIGHT_M
from sim_bridge.world.puppet import OutsidePose, Vector3


@dataclass(frozen=True, slots=True)
class TrueState:
    """What a simulator says: position [m], velocity [m/s; north-east-down], roll, pitch, yaw [rad; FRD], rates."""

    position: Vector3
    velocity: Vector3
    attitude: Vector3
    rates: Vector3


class Placement:
    """Maps true states to poses in the room. The first one is where the vehicle stands on its pad, heading included."""

    def __init__(self, pad_m: tuple[float, float], pad_yaw_rad: float) -> None:
        self._pad_m, self._pad_yaw = pad_m, pad_yaw_rad
        self._first: TrueState | None = None

    def pose(self, state: TrueState) -> OutsidePose:
        """Return the pose in the room [world, FLU]."""
        first = self._first = self._first or state
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
        )


def _turned(x: float, y: float, angle: float) -> tuple[float, float]:
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y

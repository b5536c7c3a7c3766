"""A body that is moved from outside: it follows the poses of a real vehicle; when they stop its place is unknown."""

import math
from dataclasses import dataclass

from groundstation.vectors import Vector3
from sim_bridge.world.airframe import STANDING_HEIGHT_M, Airframe
from sim_bridge.world.downwash import wake_between

STALE_S = 0.5
_AIRBORNE_M = 0.05  # above its standing height
_TINY_M = 1e-9
_NOWHERE = (math.nan,) * 13


@dataclass(frozen=True, slots=True)
class OutsidePose:
    """Pose of a real body: position [m], velocity [m/s; world], roll, pitch, yaw [rad; FLU] and body rates [rad/s].

    grain_m: step of the horizontal position; within one it is unknown.
    """

    position: Vector3
    velocity: Vector3
    attitude: Vector3
    rates: Vector3 = (0.0, 0.0, 0.0)
    grain_m: float = 0.0


class Puppet:
    """Follows poses from outside, extrapolated by their velocity. It has no motors and no sensors here.

    room_m: half length, half width, height; beyond it, and `STALE_S` after the last pose, its place is unknown.
    pad: its place until the first pose, None: unknown.
    """

    def __init__(self, room_m: Vector3, tick_s: float, pad: tuple[tuple[float, float], float] | None = None) -> None:
        self.airframe = Airframe(*(pad or ((0.0, 0.0), 0.0))[0], pad[1] if pad else 0.0)
        self._room_m, self._tick_s = room_m, tick_s
        self._rates: Vector3 = (0.0, 0.0, 0.0)
        self.age_s = math.inf
        self._waits = pad is not None
        self.poses = 0

    def follow(self, pose: OutsidePose) -> None:
        """Take a pose of the real body."""
        body, z = self.airframe, pose.position[2]
        body.x, body.y, body.z = (*self._within_grain(pose), z)
        body.vx, body.vy, body.vz = pose.velocity
        body.roll, body.pitch, body.yaw = pose.attitude
        body.on_ground = body.z < STANDING_HEIGHT_M + _AIRBORNE_M
        self._rates, self.age_s, self._waits = pose.rates, 0.0, False
        self.poses += 1

    def _within_grain(self, pose: OutsidePose) -> tuple[float, float]:
        """Return the horizontal place nearest to its present one that the pose does not exclude.

        So it moves evenly, as a real body does, and not by a grain at a time.
        """
        (told_x, told_y, _), body = pose.position, self.airframe
        away_x, away_y = body.x - told_x, body.y - told_y
        away_m, reach_m = math.hypot(away_x, away_y), pose.grain_m / math.sqrt(2.0)
        kept = 0.0 if self._waits or self.stale else min(1.0, reach_m / max(away_m, reach_m, _TINY_M))
        return told_x + kept * away_x, told_y + kept * away_y

    def step(self) -> None:
        """Advance by one tick towards the last pose."""
        self.age_s += self._tick_s
        if self.stale or self._waits:
            return
        body, dt = self.airframe, self._tick_s
        body.x, body.y, body.z = body.x + body.vx * dt, body.y + body.vy * dt, body.z + body.vz * dt
        body.yaw = math.remainder(body.yaw + self._rates[2] * dt, math.tau)

    @property
    def stale(self) -> bool:
        """Return whether its last pose is too old."""
        return self.age_s > STALE_S and not self._waits

    @property
    def outside(self) -> bool:
        """Return whether its pose lies beyond walls or ceiling."""
        body, (x, y, z) = self.airframe, self._room_m
        return abs(body.x) > x or abs(body.y) > y or body.z > z

    @property
    def nowhere(self) -> str:
        """Return the reason why its place is unknown, or ""."""
        if self.stale:
            return f"no pose of the real one for {STALE_S:g} s" if self.poses else "no pose of the real one yet"
        return "the pose of the real one lies outside of the room" if self.outside else ""

    @property
    def airborne(self) -> bool:
        """Return whether it flies, as far as its poses say."""
        return self.poses > 0 and not self.stale and not self.airframe.on_ground

    def row(self) -> tuple[float, ...]:
        """Return the 13 numbers of the truth board; NaN while its place is unknown."""
        if self.nowhere:
            return _NOWHERE
        return (*self.airframe.row()[:9], *self._rates, float(self.airframe.on_ground))

    def wake_on(self, other: Airframe) -> Vector3 | None:
        """Return the acceleration of a body below by its downwash, None out of its reach."""
        return wake_between(self.airframe, other) if self.airborne else None

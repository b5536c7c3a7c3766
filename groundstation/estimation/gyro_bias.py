"""The bias of a vehicle's gyroscopes: learnt while it stands and, slowly, from its own doubtful heading in flight."""

import math

from groundstation.bus.messages import Vector3
from groundstation.geometry.angles import difference
from groundstation.time_units import NS_PER_S

_BLOCK_NS = NS_PER_S  # of standing still give one measurement
# A vehicle that turns faster was carried [rad/s]; a block is this precise, or as its own scatter.
_STILL_RAD_S, _BLOCK_STD = 0.05, 2e-4
_UNKNOWN_STD = math.radians(0.5)  # before anything is learnt [rad/s]
_DRIFT_STD = 3e-5  # [rad/s per root second]
# Random walk of a magnetic heading, and of an integrated gyro beside its bias [rad per root second].
_HEADING_WANDER, _GYRO_WANDER = math.radians(1.7), math.radians(0.1)
_SPAN_NS = 2 * NS_PER_S  # between two uses of the heading
_GATE = 9.0  # a heading with a larger disagreement says nothing of the bias
_HORIZON_S = 20.0  # the bias's effect on the heading is modelled as a random walk that is right after this time


class GyroBias:
    """Bias of three gyroscopes [rad/s; base] and its deviation; tilt_std_rad_s: of the first two."""

    def __init__(self) -> None:
        self.rad_s: Vector3 = (0.0, 0.0, 0.0)
        self.tilt_std_rad_s = _UNKNOWN_STD
        self._variance = _UNKNOWN_STD**2
        self._block: list[Vector3] = []
        self._block_ns = 0
        self._heading: tuple[int, float, float, int] | None = None

    @property
    def yaw_std_rad(self) -> float:
        """Return the random walk of a heading by these gyroscopes [rad per root second]."""
        return math.sqrt(_GYRO_WANDER**2 + self._variance * _HORIZON_S)

    def take_standing(self, stamp_ns: int, rates_rad_s: Vector3) -> None:
        """Take the rates of a vehicle on the ground: these are bias, unless somebody carries it."""
        if not self._block:
            self._block_ns = stamp_ns
        self._block.append(rates_rad_s)
        if max(map(abs, rates_rad_s)) > _STILL_RAD_S:
            self._block.clear()
        elif stamp_ns - self._block_ns >= _BLOCK_NS:
            self._learn()
            self._block.clear()

    def leave_ground(self) -> None:
        """Discard the block begun on the ground: it may include the lift-off."""
        self._block.clear()

    def take_heading(self, stamp_ns: int, yaw_rad: float, own_yaw_rad: float, reset: int) -> None:
        """Take the vehicle's heading beside that by its gyroscopes; across a reset both mean nothing."""
        before = self._heading
        if before is None or before[3] != reset:
            self._heading = (stamp_ns, yaw_rad, own_yaw_rad, reset)
            return
        if stamp_ns - before[0] < _SPAN_NS:
            return
        elapsed_s = (stamp_ns - before[0]) / NS_PER_S
        self._heading = (stamp_ns, yaw_rad, own_yaw_rad, reset)
        ahead = difference(difference(own_yaw_rad, before[2]), difference(yaw_rad, before[1])) / elapsed_s
        self._variance += _DRIFT_STD**2 * elapsed_s
        self._correct(ahead, _HEADING_WANDER**2 / elapsed_s)

    def _learn(self) -> None:
        n, (x, y, _) = len(self._block), self.rad_s
        means = [math.fsum(rates[i] for rates in self._block) / n for i in range(3)]
        scatter = math.fsum((rates[2] - means[2]) ** 2 for rates in self._block) / n
        share = self._correct(means[2] - self.rad_s[2], _BLOCK_STD**2 + scatter / n)
        if share > 0.0:
            self.rad_s = (x + share * (means[0] - x), y + share * (means[1] - y), self.rad_s[2])
            self.tilt_std_rad_s = _BLOCK_STD

    def _correct(self, excess: float, variance: float) -> float:
        """Correct the third bias by a measured excess; returns the share that was taken, 0 beyond the gate."""
        total = self._variance + variance
        if excess * excess > _GATE * total:
            return 0.0
        share = self._variance / total
        self._variance *= 1.0 - share
        self.rad_s = (*self.rad_s[:2], self.rad_s[2] + share * excess)
        return share

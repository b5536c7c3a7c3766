"""Estimates the bias of a vehicle's gyroscopes while it stands and, slowly, in flight.

In flight accelerometers determine the bias of two axes; the third comes from a fixed camera that sees the vehicle turn,
and poorly from the vehicle's own doubtful heading.
"""

import math

from groundstation.bus.messages import Vector3
from groundstation.estimation.biased_angle import BiasedAngle
from groundstation.geometry.angles import difference, wrap
from groundstation.time_units import NS_PER_S

_BLOCK_NS = NS_PER_S  # of standing still give one measurement
# A vehicle that turns faster was carried [rad/s]; a block is this precise, or as its own scatter.
_STILL_RAD_S, _BLOCK_STD = 0.05, 2e-4
# Deviation of roll and pitch after a while; and at the start, from one sample of a vehicle that may accelerate.
_SETTLED_RAD, _FIRST_RAD = math.radians(0.5), math.radians(5.0)
# Random walk of a magnetic heading, and of an integrated gyro beside its bias [rad per root second].
_HEADING_WANDER, GYRO_WANDER = math.radians(1.7), math.radians(0.1)
# The same of a heading that a camera shows: its error changes as the vehicle crosses the view.
_SIGHT_WANDER = math.radians(0.3)
_SPAN_NS = 2 * NS_PER_S  # between two uses of the heading
_LOST_S = 2.0  # a camera that has not shown the heading for longer is begun anew, or replaced by another one
_GATE = 9.0  # a heading with a larger NIS is not used for the bias
# A gyroscope that warms up leaves the gate. After so many blocks in a row beyond it, it is the bias that is wrong.
_INSISTS = 3
_HORIZON_S = 20.0  # the bias's effect on the heading is modelled as a random walk that is right after this time


class GyroBias:
    """Bias of three gyroscopes [rad/s; base], and how well it is known."""

    def __init__(self) -> None:
        self.rad_s: Vector3 = (0.0, 0.0, 0.0)
        self._tilt, self._turn = BiasedAngle(_FIRST_RAD**2), BiasedAngle(0.0)
        self._block: list[Vector3] = []
        self._block_ns = 0
        self._refused = 0  # blocks in a row
        self._heading: tuple[int, float, float, int] | None = None
        self._seen: tuple[str, int, float] | None = None

    @property
    def tilt_std_rad(self) -> float:
        """Return the deviation of roll and of pitch [rad]."""
        return math.sqrt(self._tilt.variance)

    @property
    def yaw_std_rad(self) -> float:
        """Return the random walk of a heading by these gyroscopes [rad per root second]."""
        return math.sqrt(GYRO_WANDER**2 + self._turn.bias_variance * _HORIZON_S)

    def begin(self) -> None:
        """Begin roll, pitch and heading anew from one sample."""
        self._tilt.begin(_FIRST_RAD**2)
        self._seen = None

    def go_on(self, elapsed_s: float, within_s: float) -> None:
        """Integrate over a time; with a known bias accelerometers draw the tilt back with time constant within_s."""
        self._tilt.go_on(elapsed_s, _SETTLED_RAD**2 / within_s)
        self._turn.go_on(elapsed_s, _SIGHT_WANDER**2)

    def take_tilt(self, elapsed_s: float, within_s: float, ahead_rad: tuple[float, float]) -> tuple[float, float]:
        """Take the accelerometers' roll and pitch minus ours; returns the corrections of ours [rad]."""
        angle, bias = self._tilt.see_angle(_SETTLED_RAD**2 * within_s / elapsed_s)
        (roll, pitch), (x, y, z) = ahead_rad, self.rad_s
        self.rad_s = x + bias * roll, y + bias * pitch, z
        return angle * roll, angle * pitch

    def take_standing(self, stamp_ns: int, rates_rad_s: Vector3) -> None:
        """Take the rates of a vehicle on the ground: these are bias, unless it is carried."""
        if not self._block:
            self._block_ns = stamp_ns
        self._block.append(rates_rad_s)
        if max(map(abs, rates_rad_s)) > _STILL_RAD_S:
            self._block.clear()
            self._refused = 0
        elif stamp_ns - self._block_ns >= _BLOCK_NS:
            self._learn()
            self._block.clear()

    def leave_ground(self) -> None:
        """Discard the block begun on the ground: it may include the lift-off."""
        self._block.clear()
        self._refused = 0

    def take_heading(self, stamp_ns: int, yaw_rad: float, own_yaw_rad: float, reset: int) -> None:
        """Take the vehicle's heading beside that by its gyroscopes; differences across a reset are void."""
        before = self._heading
        if before is None or before[3] != reset:
            self._heading = (stamp_ns, yaw_rad, own_yaw_rad, reset)
            return
        if stamp_ns - before[0] < _SPAN_NS:
            return
        elapsed_s = (stamp_ns - before[0]) / NS_PER_S
        self._heading = (stamp_ns, yaw_rad, own_yaw_rad, reset)
        ahead = difference(difference(own_yaw_rad, before[2]), difference(yaw_rad, before[1])) / elapsed_s
        self._correct(ahead, _HEADING_WANDER**2 / elapsed_s)

    def take_sight(self, camera: str, stamp_ns: int, yaw_rad: float, variance: float, own_yaw_rad: float) -> None:
        """Take one fixed camera's heading of the vehicle, from any zero, beside that by the gyroscopes."""
        ahead = difference(yaw_rad, own_yaw_rad)
        last, at_ns, offset = self._seen or (camera, 0, 0.0)
        elapsed_s = (stamp_ns - at_ns) / NS_PER_S
        if elapsed_s > _LOST_S:
            self._seen = camera, stamp_ns, ahead
            self._turn.begin(variance)
        elif camera == last and elapsed_s > 0.0:
            excess = difference(ahead, offset)
            if excess * excess <= _GATE * (self._turn.variance + variance):
                angle, bias = self._turn.see_angle(variance)
                self._seen = camera, stamp_ns, wrap(offset + angle * excess)
                self.rad_s = (*self.rad_s[:2], self.rad_s[2] + bias * excess)

    def _learn(self) -> None:
        n, (x, y, _) = len(self._block), self.rad_s
        means = [math.fsum(rates[i] for rates in self._block) / n for i in range(3)]
        scatter = math.fsum((rates[2] - means[2]) ** 2 for rates in self._block) / n
        share = self._correct(means[2] - self.rad_s[2], _BLOCK_STD**2 + scatter / n, self._refused + 1 >= _INSISTS)
        self._refused = 0 if share > 0.0 else self._refused + 1
        if share > 0.0:
            self.rad_s = (x + share * (means[0] - x), y + share * (means[1] - y), self.rad_s[2])
            self._tilt.see_bias(_BLOCK_STD**2)

    def _correct(self, excess: float, variance: float, insists: bool = False) -> float:
        """Correct the third bias by a measured excess; returns the share that was taken, 0 beyond the gate.

        insists: what was learnt of the bias is wrong if the excess lies beyond the gate, and begins anew with it.
        """
        if excess * excess > _GATE * (self._turn.bias_variance + variance):
            if not insists:
                return 0.0
            self._turn = BiasedAngle(self._turn.variance)
        angle, bias = self._turn.see_bias(variance)
        self.rad_s = (*self.rad_s[:2], self.rad_s[2] + bias * excess)
        if self._seen is not None:
            self._seen = (*self._seen[:2], wrap(self._seen[2] + angle * excess))
        return bias

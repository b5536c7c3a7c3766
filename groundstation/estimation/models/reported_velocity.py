"""A target's own odometry: its velocity in its own frame, which has neither origin nor drift. A claim (reports.py).

With a heading in the block z = (forward, left) = R(yaw)^T v. Without one only the speed counts: z = |v|, linear along
the estimated direction, if the estimated speed is well above its deviation. A report of standing counts in both axes, z
= v = 0; other reports cannot be used while the direction is unknown.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.model_kernels import SensorKernels
from groundstation.estimation.models.protocol import SensorDefaults
from groundstation.estimation.records import NOT_LOCATED, VX, VY, EventRow, Prediction, SensorRow
from groundstation.kernel import kernel

# An estimated speed of this many deviations has a direction; a reported one of fewer counts as standing.
_MOVES, _STANDS = 3.0, 2.0
_SLOWEST_M_S = 1e-3  # a mode with a lower speed has no direction, and the derivative no size


@kernel()
def measure_velocity(belief: Belief, sensor: SensorRow, event: EventRow, out: Prediction) -> None:
    """Write h(x) and its Jacobian; observer and subject are the same entity."""
    mean, entity, H = belief.mean, belief.entities[event.observer], out.H_observer
    vx, vy = mean[entity.start + VX], mean[entity.start + VY]
    if entity.at_yaw >= 0:
        yaw = mean[entity.start + entity.at_yaw]
        c, s = math.cos(yaw), math.sin(yaw)
        out.h[0], out.h[1] = c * vx + s * vy, c * vy - s * vx
        H[0, VX], H[0, VY], H[0, entity.at_yaw] = c, s, out.h[1]
        H[1, VX], H[1, VY], H[1, entity.at_yaw] = -s, c, -out.h[0]
    elif out.size == 1:
        speed = max(math.hypot(vx, vy), _SLOWEST_M_S)
        out.h[0] = speed
        H[0, VX], H[0, VY] = vx / speed, vy / speed
    else:
        out.h[0], out.h[1] = vx, vy
        H[0, VX] = H[1, VY] = 1.0


@kernel()
def prepare_velocity(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, R: Matrix) -> int:
    """Turn (forward, left) into rows that can be compared with the block."""
    entity, P = belief.entities[event.observer], belief.P
    if entity.at_yaw >= 0:
        return 2
    vx, vy = entity.start + VX, entity.start + VY
    variance, speed = P[vx, vx] + P[vy, vy], math.hypot(z[0], z[1])
    if belief.mean[vx] ** 2 + belief.mean[vy] ** 2 > _MOVES**2 * variance:
        z[0] = speed
        return 1
    if speed <= _STANDS * math.sqrt(R[0, 0]):
        z[0] = z[1] = 0.0
        return 2
    return -NOT_LOCATED


@dataclass(frozen=True, slots=True)
class ReportedVelocity(SensorDefaults):
    """A target's report of its velocity (forward, left) [m/s; base]; carrier: the target itself."""

    kernels: ClassVar[SensorKernels] = SensorKernels(measure_velocity, prepare_velocity)

    carrier: str
    repeats_s: float = 0.0

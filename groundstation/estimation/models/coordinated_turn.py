"""A target that turns at a nearly constant rate: x, y, vx, vy, turn_rate (and yaw, which turns along).

Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001), section 11.7.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from groundstation.arrays import Array, Matrix
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.layout import TARGET_CORE, EntityKind
from groundstation.estimation.linear import wrap
from groundstation.estimation.model_kernels import MotionKernels
from groundstation.estimation.models.constant_velocity import add_acceleration_noise
from groundstation.estimation.models.protocol import Vector3
from groundstation.estimation.motion import depend, fade, mirror, wander
from groundstation.estimation.records import VX, VY, X, Y, own_parameters
from groundstation.kernel import Record, kernel

TURN_RATE = 4  # after x, y, vx, vy
_SMALL_RAD = 1e-3  # below it series are more exact than quotients


class TurnParameters(Record):
    """Densities of the noise of acceleration [m^2/s^3] and of heading [rad^2/s]; of the turn rate, deviation and time.

    rate_std [rad/s], rate_tau_s: of the Gauss-Markov turn rate; rate_gain: 1, or 0 for a target that drives straight.
    """

    acceleration_density: float
    yaw_density: float
    rate_std: float
    rate_tau_s: float
    rate_gain: float


_own = own_parameters(TurnParameters)


class Arc(NamedTuple):
    """a = sin(wT)/w, b = (1 - cos(wT))/w, and their derivatives by w."""

    a: float
    b: float
    a_w: float
    b_w: float


@kernel()
def arc(w: float, dt: float) -> Arc:
    """Return how a turn at rate w over dt maps velocity to displacement."""
    angle = w * dt
    if abs(angle) < _SMALL_RAD:
        return Arc(
            dt * (1.0 - angle * angle / 6.0),
            dt * angle * (0.5 - angle * angle / 24.0),
            dt * dt * angle * (-1.0 / 3.0 + angle * angle / 30.0),
            dt * dt * (0.5 - angle * angle / 8.0),
        )
    c, n = math.cos(angle), math.sin(angle)
    a, b = n / w, (1.0 - c) / w
    return Arc(a, b, (dt * c - a) / w, (dt * n - b) / w)


@kernel()
def rotate_velocity(P: Matrix, start: int, size: int, c: float, n: float) -> None:
    """Rotate the velocity's rows and, within the block, columns."""
    vx, vy = start + VX, start + VY
    for j in range(P.shape[0]):
        x, y = P[vx, j], P[vy, j]
        P[vx, j], P[vy, j] = c * x - n * y, n * x + c * y
    for i in range(start, start + size):
        x, y = P[i, vx], P[i, vy]
        P[i, vx], P[i, vy] = c * x - n * y, n * x + c * y


@kernel()
def predict_coordinated_turn(belief: Belief, e: int, dt: float) -> None:
    """Turn the velocity by its rate; with a gain of zero it stays straight and the rate has no effect."""
    mean, P, entity = belief.mean, belief.P, belief.entities[e]
    start, size, yaw, p = entity.start, entity.size, entity.at_yaw, _own(entity)
    gain = p.rate_gain
    vx, vy, w = mean[start + VX], mean[start + VY], gain * mean[start + TURN_RATE]
    turned = arc(w, dt)
    a, b, a_w, b_w = turned.a, turned.b, gain * turned.a_w, gain * turned.b_w
    c, n = math.cos(w * dt), math.sin(w * dt)
    mean[start] += a * vx - b * vy
    mean[start + 1] += b * vx + a * vy
    mean[start + VX], mean[start + VY] = c * vx - n * vy, n * vx + c * vy
    depend(P, start, size, X, VX, a)
    depend(P, start, size, X, VY, -b)
    depend(P, start, size, X, TURN_RATE, a_w * vx - b_w * vy)
    depend(P, start, size, Y, VX, b)
    depend(P, start, size, Y, VY, a)
    depend(P, start, size, Y, TURN_RATE, b_w * vx + a_w * vy)
    rotate_velocity(P, start, size, c, n)
    depend(P, start, size, VX, TURN_RATE, -gain * dt * mean[start + VY])
    depend(P, start, size, VY, TURN_RATE, gain * dt * mean[start + VX])
    if yaw >= 0:
        mean[start + yaw] = wrap(mean[start + yaw] + w * dt)
        depend(P, start, size, yaw, TURN_RATE, gain * dt)
    fade(mean, P, start, size, TURN_RATE, p.rate_std, dt / p.rate_tau_s)
    add_acceleration_noise(P, start, 0, p.acceleration_density, dt)
    add_acceleration_noise(P, start, 1, p.acceleration_density, dt)
    wander(P, start, yaw, p.yaw_density * dt)
    mirror(P, start, size, size)


@dataclass(frozen=True, slots=True)
class CoordinatedTurnTarget:
    """A ground vehicle that drives arcs: its velocity turns at `turn_rate`, a Gauss-Markov state [rad/s].

    turning=False: it drives straight, but keeps the state, so that it can be a mode beside a turning one.
    """

    kind: ClassVar[EntityKind] = EntityKind.TARGET
    kernels: ClassVar[MotionKernels] = MotionKernels(predict_coordinated_turn)
    present: ClassVar[bool] = False
    admitted: ClassVar[bool] = True

    marker_height_m: float = 0.4
    acceleration_std_m_s2: float = 0.2
    correlation_s: float = 0.12
    speed_std_m_s: float = 0.4
    turn_rate_std_rad_s: float = 0.5
    turn_rate_correlation_s: float = 3.0
    turning: bool = True
    heading: bool = False
    turn_std_rad: float = math.radians(3.0)

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the entries of the block."""
        return (*TARGET_CORE, "turn_rate", "yaw") if self.heading else (*TARGET_CORE, "turn_rate")

    @property
    def place_m(self) -> Vector3:
        """Return the place of the marker."""
        return 0.0, 0.0, self.marker_height_m

    def own(self) -> TurnParameters:
        """Return the parameters that the kernel reads."""
        return TurnParameters.row(
            acceleration_density=self.acceleration_std_m_s2**2 * self.correlation_s,
            yaw_density=self.turn_std_rad**2,
            rate_std=self.turn_rate_std_rad_s,
            # A straight mode knows nothing of the rate of the next turn.
            rate_tau_s=self.turn_rate_correlation_s if self.turning else 0.3,
            rate_gain=float(self.turning),
        )

    def prior(self) -> Array:
        """Return mean and variances (2, size) of its block when it joins."""
        prior = np.zeros((2, len(self.labels)))
        prior[1, VX] = prior[1, VY] = self.speed_std_m_s**2
        prior[1, TURN_RATE] = self.turn_rate_std_rad_s**2
        return prior

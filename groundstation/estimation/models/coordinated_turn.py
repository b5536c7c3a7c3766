"""A target that turns at a nearly constant rate: x, y, vx, vy, turn_rate (and yaw, which turns along).

Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001), section 11.7.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.dispatch import PREDICT
from groundstation.estimation.kernel import address_of, kernel
from groundstation.estimation.layout import TARGET_CORE, EntityKind
from groundstation.estimation.linear import wrap
from groundstation.estimation.models.constant_velocity import add_acceleration_noise
from groundstation.estimation.motion import depend, fade, mirror, wander

ACCELERATION_DENSITY, RATE_STD, RATE_TAU, RATE_GAIN, YAW_DENSITY = range(s.FIRST_OWN, s.FIRST_OWN + 5)
TURN_RATE = 4
_SMALL_RAD = 1e-3  # below, series are more exact than quotients


@kernel("void(float64, float64, float64[::1])")
def arc(w: float, dt: float, out: Array) -> None:
    """Write a = sin(wT)/w, b = (1 - cos(wT))/w, and their derivatives by w."""
    angle = w * dt
    if abs(angle) < _SMALL_RAD:
        out[0] = dt * (1.0 - angle * angle / 6.0)
        out[1] = dt * angle * (0.5 - angle * angle / 24.0)
        out[2] = dt * dt * angle * (-1.0 / 3.0 + angle * angle / 30.0)
        out[3] = dt * dt * (0.5 - angle * angle / 8.0)
        return
    c, n = math.cos(angle), math.sin(angle)
    out[0], out[1] = n / w, (1.0 - c) / w
    out[2], out[3] = (dt * c - out[0]) / w, (dt * n - out[1]) / w


@kernel("void(float64[:,::1], int64, int64, float64, float64)")
def rotate_velocity(P: Array, start: int, size: int, c: float, n: float) -> None:
    """Rotate the velocity's rows and, within the block, columns."""
    vx, vy = start + s.VX, start + s.VY
    for j in range(P.shape[0]):
        x, y = P[vx, j], P[vy, j]
        P[vx, j], P[vy, j] = c * x - n * y, n * x + c * y
    for i in range(start, start + size):
        x, y = P[i, vx], P[i, vy]
        P[i, vx], P[i, vy] = c * x - n * y, n * x + c * y


@kernel(PREDICT)
def predict_coordinated_turn(
    mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, e: int, dt: float
) -> None:
    """Turn the velocity by its rate; with a gain of zero it goes straight on and the rate says nothing."""
    start, size, p = entities[e, s.ENTITY_START], entities[e, s.ENTITY_SIZE], parameters[e]
    gain, yaw = p[RATE_GAIN], entities[e, s.AT_YAW]
    vx, vy, w = mean[start + s.VX], mean[start + s.VY], gain * mean[start + TURN_RATE]
    turned = np.empty(4)
    arc(w, dt, turned)
    a, b, a_w, b_w = turned[0], turned[1], gain * turned[2], gain * turned[3]
    c, n = math.cos(w * dt), math.sin(w * dt)
    mean[start] += a * vx - b * vy
    mean[start + 1] += b * vx + a * vy
    mean[start + s.VX], mean[start + s.VY] = c * vx - n * vy, n * vx + c * vy
    depend(P, start, size, s.X, s.VX, a)
    depend(P, start, size, s.X, s.VY, -b)
    depend(P, start, size, s.X, TURN_RATE, a_w * vx - b_w * vy)
    depend(P, start, size, s.Y, s.VX, b)
    depend(P, start, size, s.Y, s.VY, a)
    depend(P, start, size, s.Y, TURN_RATE, b_w * vx + a_w * vy)
    rotate_velocity(P, start, size, c, n)
    depend(P, start, size, s.VX, TURN_RATE, -gain * dt * mean[start + s.VY])
    depend(P, start, size, s.VY, TURN_RATE, gain * dt * mean[start + s.VX])
    if yaw >= 0:
        mean[start + yaw] = wrap(mean[start + yaw] + w * dt)
        depend(P, start, size, yaw, TURN_RATE, gain * dt)
    fade(mean, P, start, size, TURN_RATE, p[RATE_STD], dt / p[RATE_TAU])
    add_acceleration_noise(P, start, 0, p[ACCELERATION_DENSITY], dt)
    add_acceleration_noise(P, start, 1, p[ACCELERATION_DENSITY], dt)
    wander(P, start, yaw, p[YAW_DENSITY] * dt)
    mirror(P, start, size, size)


@dataclass(frozen=True, slots=True)
class CoordinatedTurnTarget:
    """A ground vehicle that drives arcs: its velocity turns at `turn_rate`, a Gauss-Markov state [rad/s].

    turning=False: it goes straight on, but keeps the state, so that it can be a mode beside a turning one.
    """

    kind: ClassVar[EntityKind] = EntityKind.TARGET
    kernels: ClassVar[tuple[int, int]] = (address_of(predict_coordinated_turn), 0)
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

    def row(self) -> Array:
        """Return the parameters in the columns that the kernel reads."""
        row = np.zeros(s.PARAMETER_COLUMNS)
        row[s.PLACE_Z] = self.marker_height_m
        row[ACCELERATION_DENSITY] = self.acceleration_std_m_s2**2 * self.correlation_s
        row[RATE_STD], row[RATE_GAIN] = self.turn_rate_std_rad_s, float(self.turning)
        # A mode that goes straight on knows nothing of the rate that the next turn will have.
        row[RATE_TAU] = self.turn_rate_correlation_s if self.turning else 0.3
        row[YAW_DENSITY] = self.turn_std_rad**2
        return row

    def prior(self) -> Array:
        """Return mean and variances (2, size) of what joins."""
        prior = np.zeros((2, len(self.labels)))
        prior[1, s.VX] = prior[1, s.VY] = self.speed_std_m_s**2
        prior[1, TURN_RATE] = self.turn_rate_std_rad_s**2
        return prior

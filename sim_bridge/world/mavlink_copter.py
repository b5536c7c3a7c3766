"""A quadrotor with a velocity-controlled autopilot (PX4- or ArduPilot-like): its response to velocity setpoints.

Step responses as measured on real firmwares (docs/reference/mavlink.md 1, 2): ArduCopter t10 0.31, t63 0.74, t90
1.23-1.41 s, all of the speed; PX4 t10 0.22, t63 0.67, t90 1.35 s, 14-20 % under the command for seconds. Frames are FLU
and world.
"""

import math
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np

from groundstation.vectors import Vector3
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.world.airframe import GRAVITY_M_S2, Airframe
from sim_bridge.world.downwash import wake_between
from sim_bridge.world.mavlink_estimator import InertialEstimate
from sim_bridge.world.noise import DelayLine, GaussMarkov, standard_normals

_STILL: Vector3 = (0.0, 0.0, 0.0)
_UNREST_CORRELATION_S = 0.8
_MOST_M_S2 = 3.0
_CLIMB_RATE, _CLIMB_DAMPING = 4.4, 0.6
_YAW_RATE = 6.0
_HOLD_GAIN, _HOLD_M_S = 0.9, 0.5
GO_M_S, _FACE_GAIN, _FACE_RAD_S = 2.0, 1.5, 1.0
_TILT_TIME_S = 0.12
_DESCENT_M_S, _TOUCH_DOWN_M_S, _FLARE_M = 0.5, 0.3, 0.8
_DRAG = 0.25  # 1/s, when only the attitude is held
_BRACE_S = 1.0  # until it leans fully against steady air


class Steering(Enum):
    """Actions of the motors."""

    OFF = auto()
    IDLE = auto()
    VELOCITY = auto()
    HOLD = auto()
    LEVEL = auto()
    LAND = auto()


@dataclass(frozen=True, slots=True)
class Response:
    """Response of one firmware to a velocity step: dead time, natural frequency [rad/s], damping, final gain.

    lift_off: its share of the scenario's velocity error at lift-off.
    """

    dead_s: float
    rate: float
    damping: float
    gain: float
    lift_off: float


PX4_RESPONSE = Response(dead_s=0.06, rate=3.3, damping=0.92, gain=0.85, lift_off=1.0)
# From its pad to the first velocity ArduCopter drifted by 0.03 m, where PX4 did by 0.5 to 1.3 m (docs/decisions/0235).
ARDUPILOT_RESPONSE = Response(dead_s=0.13, rate=3.5, damping=1.0, gain=1.0, lift_off=0.05)


class MavlinkCopter:
    """A drone standing on its pad. `steering` and the methods take the requests, `airframe` holds the true state.

    wind: acceleration by a fault's wind [m/s^2; world].
    """

    def __init__(
        self, pad_m: tuple[float, float], yaw_rad: float, scenario: CopterScenario, response: Response, tick_s: float,
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        draw = standard_normals(rng)
        self.airframe = Airframe(*pad_m, yaw_rad)
        self.estimate = InertialEstimate(scenario, tick_s, rng, response.lift_off)
        self.steering = Steering.OFF
        self.battery = float(rng.uniform(*scenario.battery))
        self.since_s = 0.0  # in this steering
        self._response, self._tick_s = response, tick_s
        low, high = scenario.velocity_gain or (response.gain, response.gain)
        self._gain = low if low == high else float(rng.uniform(low, high))
        drift = scenario.hover_drift_m_s
        self._drift = (drift * draw(), drift * draw()) if drift else (0.0, 0.0)
        self._drain = scenario.battery_drain_per_min / 60.0 * tick_s
        self._unrest = tuple(
            GaussMarkov(scenario.air_unrest_m_s2 * share, _UNREST_CORRELATION_S, tick_s, draw)
            for share in (1.0, 1.0, 0.5)
        )
        self._wanted: tuple[Vector3, float] = (_STILL, 0.0)
        self._delayed: DelayLine[tuple[Vector3, float]] = DelayLine(response.dead_s, tick_s, (_STILL, 0.0))
        self._acceleration = [0.0, 0.0, 0.0]  # heading frame
        self._held: Vector3 | None = None
        self._goes = False
        self._faces: float | None = None
        self.fastest_m_s = GO_M_S  # on its way to a place
        self.wind = self._braced = (0.0, 0.0)

    @property
    def autopilot(self) -> "MavlinkCopter":
        """Return itself: the part that turns its propellers."""
        return self

    @property
    def motors_on(self) -> bool:
        """Return whether the propellers turn."""
        return self.steering is not Steering.OFF

    @property
    def airborne(self) -> bool:
        """Return whether it has no contact with the floor."""
        return not self.airframe.on_ground

    def steer(self, steering: Steering) -> None:
        """Change the state of the motors."""
        if steering is not self.steering or self._goes:
            self.steering, self.since_s, self._held = steering, 0.0, None
            self._goes, self._faces = False, None
            self._wanted = (_STILL, 0.0)
            if steering in (Steering.OFF, Steering.IDLE):
                self._acceleration = [0.0, 0.0, 0.0]

    def fly(self, velocity_m_s: Vector3, yaw_rate_rad_s: float) -> None:
        """Fly a velocity [heading frame, FLU] until the next command."""
        self.steer(Steering.VELOCITY)
        self._wanted = (velocity_m_s, yaw_rate_rad_s)

    def go(self, place: Vector3, yaw: float | None) -> None:
        """Fly to a place [m; of its own estimate] and hold it; yaw: the heading to turn to [rad], None: the present."""
        if not self._goes:
            self.steer(Steering.HOLD)
        self._held, self._faces, self._goes = place, yaw, True

    def face(self, yaw: float) -> None:
        """Turn to a heading [rad], on its way to a place or where it is."""
        self.go(self._held if self._goes and self._held else self.estimate.position, yaw)

    def step(self, wake: Vector3) -> None:
        """Advance by one tick under the wake of the others [m/s^2; world]."""
        self.since_s += self._tick_s
        wanted = self._delayed.push(self._wanted)
        body = self.airframe
        if self.motors_on:
            self.battery = max(0.0, self.battery - self._drain)
            wake = (
                wake[0] + self._unrest[0].step(),
                wake[1] + self._unrest[1].step(),
                wake[2] + self._unrest[2].step(),
            )
            wake = self._blown(wake)
        match self.steering:
            case Steering.OFF:
                if not body.on_ground:
                    self._move((0.0, 0.0, -GRAVITY_M_S2), 0.0, wake)
            case Steering.IDLE:
                return
            case Steering.VELOCITY:
                (forward, left, up), turn = wanted
                if body.on_ground and up <= 0.05:
                    return
                drift_x, drift_y = self._drift
                self._pursue((self._gain * forward + drift_x, self._gain * left + drift_y, up), turn, wake)
            case Steering.HOLD:
                wanted_m_s = self._towards_held()
                if body.on_ground and wanted_m_s[2] <= 0.05:
                    return
                self._pursue(wanted_m_s, self._towards_faced(), wake)
            case Steering.LAND:
                if body.on_ground:
                    return  # the landing detector has cut the thrust
                self._pursue((0.0, 0.0, -(_DESCENT_M_S if body.z > _FLARE_M else _TOUCH_DOWN_M_S)), 0.0, wake)
            case Steering.LEVEL:
                vx, vy = body.velocity_stabilized()
                self._acceleration[0], self._acceleration[1] = -_DRAG * vx, -_DRAG * vy
                self._vertical(-0.5 * self.estimate.velocity[2])
                self._move(tuple(self._acceleration), 0.0, wake)

    def sense(self) -> None:
        """Let its estimator take the readings of this tick."""
        self.estimate.step(self.airframe, self.motors_on)

    def _blown(self, push: Vector3) -> Vector3:
        share, (x, y) = self._tick_s / _BRACE_S, self._braced
        self._braced = (x + share * (self.wind[0] - x), y + share * (self.wind[1] - y))
        return push[0] + self.wind[0] - self._braced[0], push[1] + self.wind[1] - self._braced[1], push[2]

    def _towards_held(self) -> Vector3:
        position = self.estimate.position
        if self._held is None:
            self._held = position
        dx, dy, dz = (_HOLD_GAIN * (h - p) for h, p in zip(self._held, position, strict=True))
        c, s = math.cos(self.estimate.yaw), math.sin(self.estimate.yaw)
        most = self.fastest_m_s if self._goes else _HOLD_M_S
        if self._goes and (speed := math.hypot(dx, dy)) > most:
            dx, dy = dx * most / speed, dy * most / speed
        limited = [max(-most, min(most, v)) for v in (c * dx + s * dy, c * dy - s * dx, dz)]
        return limited[0], limited[1], max(-_HOLD_M_S, min(_HOLD_M_S, limited[2]))

    def _towards_faced(self) -> float:
        if self._faces is None:
            return 0.0
        turn = _FACE_GAIN * math.remainder(self._faces - self.estimate.yaw, math.tau)
        return max(-_FACE_RAD_S, min(_FACE_RAD_S, turn))

    def _pursue(self, wanted: Vector3, turn: float, wake: Vector3) -> None:
        # The autopilot has only its estimate of velocity and heading.
        response, estimate = self._response, self.estimate
        c, s = math.cos(estimate.yaw), math.sin(estimate.yaw)
        vx, vy, vz = estimate.velocity
        for axis, error in enumerate((wanted[0] - c * vx - s * vy, wanted[1] - c * vy + s * vx)):
            a = self._acceleration[axis]
            a += (response.rate**2 * error - 2 * response.damping * response.rate * a) * self._tick_s
            self._acceleration[axis] = max(-_MOST_M_S2, min(_MOST_M_S2, a))
        self._vertical(wanted[2] - vz)
        self._move(tuple(self._acceleration), turn, wake)

    def _vertical(self, error: float) -> None:
        a = self._acceleration[2]
        self._acceleration[2] = a + (_CLIMB_RATE**2 * error - 2 * _CLIMB_DAMPING * _CLIMB_RATE * a) * self._tick_s

    def _move(self, acceleration: tuple[float, ...], turn: float, push: Vector3) -> None:
        """Integrate an acceleration [heading frame]; the tilt follows from it."""
        body, dt = self.airframe, self._tick_s
        c, s = math.cos(body.yaw), math.sin(body.yaw)
        forward, left, up = acceleration
        body.ax, body.ay, body.az = c * forward - s * left + push[0], s * forward + c * left + push[1], up + push[2]
        x, y = self._braced
        forward, left = forward - c * x - s * y, left - c * y + s * x  # the part of it that tilts
        share = dt / _TILT_TIME_S
        body.roll_rate = (math.atan(-left / GRAVITY_M_S2) - body.roll) / _TILT_TIME_S
        body.pitch_rate = (math.atan(forward / GRAVITY_M_S2) - body.pitch) / _TILT_TIME_S
        body.roll += share * (math.atan(-left / GRAVITY_M_S2) - body.roll)
        body.pitch += share * (math.atan(forward / GRAVITY_M_S2) - body.pitch)
        body.yaw_rate += _YAW_RATE * (turn - body.yaw_rate) * dt
        body.yaw = math.remainder(body.yaw + body.yaw_rate * dt, math.tau)
        if body.advance(dt):
            self._acceleration = [0.0, 0.0, 0.0]

    def wake_on(self, other: Airframe) -> Vector3 | None:
        """Return the acceleration of a body below by this drone's downwash, None out of its reach."""
        return wake_between(self.airframe, other)

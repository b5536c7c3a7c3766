"""Flight control of an AR.Drone's firmware: phases, take-off and landing profiles, hover by optical flow."""

import math
from dataclasses import dataclass
from enum import Enum, auto
from typing import NamedTuple

from sim_bridge.world.airframe import GRAVITY_M_S2, Airframe
from sim_bridge.world.ardrone_animations import FLIP_KICK_M_S2, FLIP_KICK_S, FLIP_TURN_S, FLIPS, Animation, motion_at
from sim_bridge.world.noise import DelayLine, Draw, GaussMarkov

# Profile of a recorded take-off: the motors' ramp carries the drone from 2.9 s on; 0.27 m at 3.35 s, 0.62 m at 3.77 s,
# peak 0.82 m, settled at 0.76 m.
LIFT_OFF_S = 2.9
_LIFT_OFF_M_S2 = 2.1
HOVERING_S = 4.8
TAKE_OFF_HEIGHT_M = 0.76
_TAKE_OFF_RATE, _TAKE_OFF_DAMPING = 3.66, 0.627

COMMAND_DELAY_S = 0.05
_CLIMB_RATE = 1.4  # 1/s: first order (tum_ardrone's identified model)
_HEIGHT_GAIN = 0.8
_BRAKE_GAIN, _HOLD_GAIN = 2.2, 1.0
_BRAKED_M_S = 0.1
# How fast a drone that holds its place learns its tilt against steady air.
_BRACE_S = 1.0
_DESCENT_M_S, _TOUCH_DOWN_M_S, _FLARE_M = 0.5, 0.3, 0.8
# The magnetometer is calibrated by one turn on the spot.
_CALIBRATION_RAD_S, _CALIBRATION_S = -math.tau / 4.0, 4.1


class Phase(Enum):
    """Flight phases; CUT is the emergency state with the motors off."""

    LANDED = auto()
    TAKING_OFF = auto()
    HOVERING = auto()
    FLYING = auto()
    BRAKING = auto()
    LOOPING = auto()
    LANDING = auto()
    CUT = auto()


_STEERED = (Phase.HOVERING, Phase.FLYING, Phase.BRAKING)
_AT_REST = (Phase.LANDED, Phase.CUT)


@dataclass(frozen=True, slots=True)
class FlightLimits:
    """Limits of the firmware; factory values."""

    tilt_rad: float = 0.20943999
    climb_m_s: float = 0.7
    yaw_rate_rad_s: float = 1.7453290
    height_m: float = 3.0


class MotionReferences(NamedTuple):
    """References while FLYING [rad, rad, m/s, rad/s; FLU]; coordinated: turns bank like an aircraft's."""

    roll_rad: float
    pitch_rad: float
    climb_m_s: float
    yaw_rate_rad_s: float
    coordinated: bool = False


class Autopilot:
    """Turns requests into references for the airframe. Motion commands take effect after `COMMAND_DELAY_S`.

    blind: optical flow finds nothing; floor_m: height of the surface below the ultrasound; braced: the acceleration
    by the air that it leans against [m/s^2; world].
    """

    def __init__(self, airframe: Airframe, tick_s: float, draw: Draw) -> None:
        self.phase = Phase.LANDED
        self.limits = FlightLimits()
        self._airframe = airframe
        self._tick_s = tick_s
        self._since_s = 0.0
        self._wanted: MotionReferences | None = None
        self._delayed: DelayLine[MotionReferences | None] = DelayLine(COMMAND_DELAY_S, tick_s, None)
        self._held_height_m: float | None = None
        self.blind = False
        self.floor_m = 0.0
        self.braced = (0.0, 0.0)
        self._drift = (0.0, 0.0)
        self._stunt: Animation | None = None
        self._stunt_s = self._stunt_end_s = self._calibration_s = 0.0
        # Optical flow is biased for seconds at a time: that is why a hovering drone wanders.
        self._flow_error = (GaussMarkov(0.015, 8.0, tick_s, draw), GaussMarkov(0.015, 8.0, tick_s, draw))

    @property
    def motors_on(self) -> bool:
        """Return whether the propellers turn."""
        return self.phase not in _AT_REST

    @property
    def since_s(self) -> float:
        """Return how long the phase has lasted."""
        return self._since_s

    @property
    def calibrating(self) -> bool:
        """Return whether it is turning to calibrate the magnetometer."""
        return self._calibration_s > 0.0 and self.phase is Phase.HOVERING

    def take_off(self) -> None:
        """Start the motors, if landed."""
        if self.phase is Phase.LANDED:
            self._enter(Phase.TAKING_OFF)

    def land(self) -> None:
        """Descend and stop the motors; a drone that has not lifted off yet stops them at once."""
        if self.phase is Phase.TAKING_OFF and self._airframe.on_ground:
            self._enter(Phase.LANDED)
        elif self.motors_on and self.phase is not Phase.LANDING:
            self._enter(Phase.LANDING)

    def cut_motors(self) -> None:
        """Emergency: motors off, whatever the height."""
        self._enter(Phase.CUT)

    def clear_emergency(self) -> None:
        """Leave the emergency state, once on the floor."""
        if self.phase is Phase.CUT and self._airframe.on_ground:
            self._enter(Phase.LANDED)

    def move(self, motion: MotionReferences) -> None:
        """Fly with these references (clamped to the limits) until the next command."""
        limits = self.limits
        self._wanted = MotionReferences(
            _clamp(motion.roll_rad, limits.tilt_rad),
            _clamp(motion.pitch_rad, limits.tilt_rad),
            _clamp(motion.climb_m_s, limits.climb_m_s),
            _clamp(motion.yaw_rate_rad_s, limits.yaw_rate_rad_s),
            motion.coordinated,
        )

    def hover(self) -> None:
        """Brake and hold position by optical flow."""
        self._wanted = None

    def animate(self, animation: Animation, duration_s: float) -> None:
        """Perform an animation; ignored on the ground, in transitions and during another one."""
        if self.phase not in _STEERED or self._stunt is not None:
            return
        self._stunt, self._stunt_s, self._stunt_end_s = animation, 0.0, duration_s
        if animation in FLIPS:
            self._enter(Phase.LOOPING)
            self._stunt = animation

    def calibrate(self) -> None:
        """Turn once on the spot; only while hovering."""
        if self.phase is Phase.HOVERING:
            self._calibration_s = _CALIBRATION_S

    def brace(self, air: tuple[float, float]) -> None:
        """Learn the push of the air from one tick [m/s^2; world]."""
        share, (x, y) = self._tick_s / _BRACE_S, self.braced
        self.braced = (x + share * (air[0] - x), y + share * (air[1] - y))

    def step(self, push: tuple[float, float, float]) -> None:
        """Advance the airframe by one tick; push: acceleration by the air [m/s^2; world]."""
        self._since_s += self._tick_s
        motion = self._delayed.push(self._wanted)
        if self.phase in _STEERED:
            self._step_flight(motion, push)
            return
        match self.phase:
            case Phase.CUT:
                self._fall(push)
            case Phase.TAKING_OFF:
                self._step_take_off(push)
            case Phase.LANDING:
                self._step_landing(push)
            case Phase.LOOPING:
                self._step_flip(push)

    def _enter(self, phase: Phase) -> None:
        if phase is not self.phase:
            self.phase = phase
            self._since_s = 0.0
            self._drift = (0.0, 0.0)
            self._held_height_m = None
            self._calibration_s = 0.0
            if phase is not Phase.FLYING:
                self._stunt = None

    def _fall(self, push: tuple[float, float, float]) -> None:
        if not self._airframe.on_ground:
            body = self._airframe
            self._airframe.step(self._tick_s, (body.roll, body.pitch), -GRAVITY_M_S2, 0.0, push)

    def _step_take_off(self, push: tuple[float, float, float]) -> None:
        if self._since_s < LIFT_OFF_S:
            return
        if self._since_s >= HOVERING_S:
            self._enter(Phase.HOVERING)
            self._held_height_m = TAKE_OFF_HEIGHT_M
        body = self._airframe
        rise = _TAKE_OFF_RATE**2 * (TAKE_OFF_HEIGHT_M - body.z) - 2 * _TAKE_OFF_DAMPING * _TAKE_OFF_RATE * body.vz
        body.step(self._tick_s, self._hover_tilt(), min(rise, _LIFT_OFF_M_S2), 0.0, push)

    def _step_landing(self, push: tuple[float, float, float]) -> None:
        body = self._airframe
        descent = _DESCENT_M_S if body.z > _FLARE_M else _TOUCH_DOWN_M_S
        body.step(self._tick_s, self._hover_tilt(), self._climb(-descent), 0.0, push)
        if body.on_ground:
            self._enter(Phase.LANDED)

    def _step_flight(self, motion: MotionReferences | None, push: tuple[float, float, float]) -> None:
        body = self._airframe
        if self._stunt is not None:
            motion = self._perform(self._stunt)
        if motion is None:
            if self.phase is Phase.FLYING:
                self._enter(Phase.BRAKING)
            elif self.phase is Phase.BRAKING and (self.blind or math.hypot(body.vx, body.vy) < _BRAKED_M_S):
                self._enter(Phase.HOVERING)
            turn = _CALIBRATION_RAD_S if self.calibrating else 0.0
            self._calibration_s -= self._tick_s
            body.step(self._tick_s, self._hover_tilt(), self._climb(0.0), turn, push)
        else:
            self._enter(Phase.FLYING)
            roll = motion.roll_rad + (self._bank(motion.yaw_rate_rad_s) if motion.coordinated else 0.0)
            tilt = (roll, motion.pitch_rad)
            body.step(self._tick_s, tilt, self._climb(motion.climb_m_s), motion.yaw_rate_rad_s, push)
        if body.on_ground:
            self._enter(Phase.LANDED)

    def _perform(self, stunt: Animation) -> MotionReferences | None:
        """Return the references of an animation, None at its end."""
        self._stunt_s += self._tick_s
        if self._stunt_s > self._stunt_end_s:
            self._stunt = self._wanted = None
            return None
        return MotionReferences(*motion_at(stunt, self._stunt_s))

    def _step_flip(self, push: tuple[float, float, float]) -> None:
        body, stunt = self._airframe, self._stunt
        if self._since_s <= FLIP_KICK_S or stunt is None:
            body.step(self._tick_s, (0.0, 0.0), FLIP_KICK_M_S2, 0.0, push)
        elif self._since_s <= FLIP_KICK_S + FLIP_TURN_S:
            roll, pitch = FLIPS[stunt]
            rate = math.tau / FLIP_TURN_S
            body.tumble(self._tick_s, roll * rate, pitch * rate)
        else:
            body.level()
            self._enter(Phase.BRAKING)

    def _bank(self, yaw_rate_rad_s: float) -> float:
        """Return the roll that carries the present forward speed around a turn."""
        forward, _ = self._airframe.velocity_stabilized()
        return _clamp(-math.atan(forward * yaw_rate_rad_s / GRAVITY_M_S2), self.limits.tilt_rad)

    def _climb(self, climb_m_s: float) -> float:
        """Return the vertical acceleration that follows a climb rate, or holds the height when it is zero."""
        body = self._airframe
        height_m = body.z - self.floor_m
        if climb_m_s != 0.0:
            self._held_height_m = None
        else:
            if self._held_height_m is None:
                self._held_height_m = height_m + body.vz / _CLIMB_RATE / 2
            climb_m_s = _clamp(_HEIGHT_GAIN * (self._held_height_m - height_m), self.limits.climb_m_s)
        ceiling = self.limits.height_m - height_m
        return _CLIMB_RATE * (min(climb_m_s, ceiling) - body.vz)

    def _hover_tilt(self) -> tuple[float, float]:
        """Return (roll, pitch) that stop the flow seen below and hold the place found by integrating it."""
        forward, left = self._airframe.velocity_stabilized()
        forward += self._flow_error[0].step()
        left += self._flow_error[1].step()
        if self.blind:
            return 0.0, 0.0
        x, y = self._drift
        if math.hypot(forward, left) < 0.5:  # it holds a place only once it has slowed down
            x, y = x + forward * self._tick_s, y + left * self._tick_s
            self._drift = (x, y)
        limit = self.limits.tilt_rad
        pitch = -(_BRAKE_GAIN * forward + _HOLD_GAIN * x) / GRAVITY_M_S2
        roll = (_BRAKE_GAIN * left + _HOLD_GAIN * y) / GRAVITY_M_S2
        if self.braced != (0.0, 0.0):
            c, s = math.cos(self._airframe.yaw), math.sin(self._airframe.yaw)
            (ax, ay), g = self.braced, GRAVITY_M_S2
            pitch, roll = pitch - (c * ax + s * ay) / g, roll + (c * ay - s * ax) / g
        return _clamp(roll, limit), _clamp(pitch, limit)


def _clamp(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))

"""Tilt, climb and turn fractions that make an AR.Drone fly a velocity. Pure.

The drone takes tilt angles, not velocities: it accelerates by g tan(tilt) and is braked by the air. Tilt answers late
(10 / 63 / 90 % after 90 / 180 / 270 ms), and so does its speed (20-40 ms). How the axes work: `velocity_axis.py`.
"""

import math
from dataclasses import dataclass

from drivers.ardrone.flow_watch import NO_MOTION_M_S
from drivers.ardrone.odometry_drift import DriftLimits, OdometryDrift
from drivers.ardrone.settings import ArDroneLimits
from drivers.ardrone.velocity_axis import Axis, Gains, clamp
from groundstation.bus.messages import Vector3
from groundstation.geometry.stabilized_frame import STANDARD_GRAVITY_M_S2

_LONGEST_STEP_S = 0.1
# Time constant for following the speed of a drone that holds its place by itself: it covers noise, and its braking.
_HELD_S = 0.15
# Share of a first measured speed that is motion: half of it is noise of a drone that holds its place. All of it, for
# this time, after a drone was not heard or did not hear: it flew its last attitude on.
_OF_HOVER, _FLEW_ON_S = 0.5, 0.5
# A drone that reports to stand and does not lags behind its commands by more than this; integral of the excess at which
# that counts, and how fast it shrinks.
_STANDS_OFF_M_S, _STANDS_OFF_M, _FORGETS_M_S = 0.15, 0.05, 0.2


@dataclass(frozen=True, slots=True)
class AttitudeRequest:
    """A request to the drone, FLU: pitch nose down (forward) and roll right side down [rad], climb, yaw rate ccw.

    hover: let the drone hold its place by itself; the other fields are zero then.
    """

    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    climb_m_s: float = 0.0
    yaw_rate_rad_s: float = 0.0
    hover: bool = False


HOVER = AttitudeRequest(hover=True)


class VelocityLoop:
    """Follows the wanted velocity by a model of its response, on both horizontal axes.

    It compensates drag and wind by the accelerometers. Climb and yaw rate are passed on within limits.
    """

    def __init__(self, limits: ArDroneLimits, gains: Gains | None = None) -> None:
        self._limits = limits
        self._max_acceleration = STANDARD_GRAVITY_M_S2 * math.tan(limits.max_tilt_rad)
        self._gains = gains or Gains()
        self._axes = (Axis(self._gains), Axis(self._gains))
        self._flew_on_s = 0.0
        self._drifts = (OdometryDrift(DriftLimits()), OdometryDrift(DriftLimits()))
        self.reset()

    @property
    def contradicted(self) -> bool:
        """Return whether the measured velocity contradicts the commanded one."""
        stands = self._stands_off_m > _STANDS_OFF_M
        return self._flying and (stands or any(axis.contradicted for axis in self._axes))

    @property
    def commanded_m_s(self) -> float:
        """Return the speed that the commands should show in its reports by now; 0 in wind, where it may well stand."""
        if not self._flying or any(axis.in_wind for axis in self._axes):
            return 0.0
        return math.hypot(*(axis.expected_m_s for axis in self._axes))

    def reset(self) -> None:
        """Forget the motion, but not the learned figures of the vehicle; for times without this loop."""
        self._flying = False
        self._still_s = self._stands_off_m = 0.0
        self._held_m_s: tuple[float, float] | None = None
        for drift in self._drifts:
            drift.reset()

    def lose(self) -> None:
        """Forget the motion of a drone that is not heard, or does not hear: it may fly its last attitude on."""
        self.reset()
        self._flew_on_s = _FLEW_ON_S

    def hold(self, measured_m_s: Vector3, dt_s: float) -> AttitudeRequest:
        """Let the drone hold its place, and note its true (scaled) speed, from which it is braked if it goes blind."""
        x, y, _ = measured_m_s
        before_x, before_y = self._held_m_s or (x, y)
        share = min(1.0, max(dt_s, 0.0) / _HELD_S)
        self._flew_on_s = max(0.0, self._flew_on_s - dt_s)
        self.reset()
        self._held_m_s = before_x + share * (x - before_x), before_y + share * (y - before_y)
        return HOVER

    def recover(self, seen_m_s: tuple[float, float], dt_s: float) -> None:
        """Take the speed from cameras (forward and left), whose mean is half a second old, and commands since then."""
        if not self._flying:
            self.hold((*seen_m_s, 0.0), dt_s)
            return
        self._stands_off_m = 0.0
        for axis, seen in zip(self._axes, seen_m_s, strict=True):
            axis.recover(seen)

    def stand(self, force_m_s2: tuple[float, float], dt_s: float) -> None:
        """Learn the accelerometer readings (forward, left) of a standing drone."""
        for axis, force in zip(self._axes, force_m_s2, strict=True):
            axis.stand(force, dt_s)

    def step(
        self,
        wanted_m_s: Vector3,
        yaw_rate_rad_s: float,
        measured_m_s: Vector3 | None,
        dt_s: float,
        force_m_s2: tuple[float, float] | None = None,
        seen_m_s: tuple[float, float] | None = None,
    ) -> AttitudeRequest:
        """Return the attitude for a wanted velocity, given the true (scaled) one [base_stabilized, FLU].

        measured_m_s: None while the drone does not see its motion: it is then integrated from commands and forces.
        force_m_s2: specific force forward and left [base], None if not reported. seen_m_s: velocity forward and left by
        cameras, or None.
        """
        gains = self._gains
        dt_s = min(max(dt_s, 0.0), _LONGEST_STEP_S)
        if measured_m_s is not None:
            for drift, told, seen in zip(self._drifts, measured_m_s, seen_m_s or (None, None), strict=False):
                drift.compare(told, seen, dt_s)
            self._compare_standing(math.hypot(*measured_m_s[:2]), dt_s)
        turn_rad_s = clamp(yaw_rate_rad_s, self._limits.max_yaw_rate_rad_s)
        moving = max(abs(yaw_rate_rad_s), *(abs(v) for v in wanted_m_s)) > gains.still
        self._still_s = 0.0 if moving else self._still_s + dt_s
        if self._still_s >= gains.settle_s:
            self._flying = False
            return HOVER
        return self._request(wanted_m_s, turn_rad_s, measured_m_s, dt_s, force_m_s2)

    def _compare_standing(self, told_m_s: float, dt_s: float) -> None:
        """Compare a speed of nearly zero with the commands."""
        excess = -_FORGETS_M_S
        if told_m_s < NO_MOTION_M_S:
            excess = max(excess, self.commanded_m_s - told_m_s - _STANDS_OFF_M_S)
        self._stands_off_m = max(0.0, self._stands_off_m + excess * dt_s)

    def brake(
        self,
        dt_s: float,
        force_m_s2: tuple[float, float] | None = None,
        seen_m_s: tuple[float, float] | None = None,
        climb_m_s: float = 0.0,
    ) -> AttitudeRequest:
        """Return the attitude that stops a drone whose velocity is wrong, from its last correct speed.

        Its own hover does not brake then: the firmware uses the same optical flow. seen_m_s: velocity forward and left
        by cameras; without it the error of that last speed stays. climb_m_s: climb meanwhile, within limits.
        """
        dt_s = min(max(dt_s, 0.0), _LONGEST_STEP_S)
        if self.contradicted:
            self._stands_off_m = 0.0
            for axis in self._axes:
                axis.distrust()
        for axis in self._axes:
            axis.brake()
        for axis, seen in zip(self._axes, seen_m_s or (), strict=False):
            axis.see(seen, dt_s)
        return self._request((0.0, 0.0, climb_m_s), 0.0, None, dt_s, force_m_s2)

    def _request(
        self,
        wanted_m_s: Vector3,
        turn_rad_s: float,
        measured_m_s: Vector3 | None,
        dt_s: float,
        force_m_s2: tuple[float, float] | None,
    ) -> AttitudeRequest:
        x, y = self._accelerations(wanted_m_s, turn_rad_s, measured_m_s, dt_s, force_m_s2)
        return AttitudeRequest(
            roll_rad=-math.atan(y / STANDARD_GRAVITY_M_S2),
            pitch_rad=math.atan(x / STANDARD_GRAVITY_M_S2),
            climb_m_s=clamp(wanted_m_s[2], self._limits.max_climb_m_s),
            yaw_rate_rad_s=turn_rad_s,
        )

    def _accelerations(
        self,
        wanted_m_s: Vector3,
        turn_rad_s: float,
        measured_m_s: Vector3 | None,
        dt_s: float,
        force_m_s2: tuple[float, float] | None,
    ) -> tuple[float, float]:
        axes = self._axes
        if not self._flying:
            self._flying = True
            first: tuple[float, ...] = self._held_m_s or (0.0, 0.0)
            if measured_m_s is not None:
                share = 1.0 if self._flew_on_s > 0.0 else _OF_HOVER
                first = tuple(share * v for v in measured_m_s)
            self._held_m_s = None
            for axis, speed in zip(axes, first, strict=False):
                axis.start(speed)
        wanted = _shortened(wanted_m_s[0], wanted_m_s[1], self._limits.max_speed_m_s)
        # Seen from a frame that turns left a steady velocity turns right, and holding one takes a pull to the left.
        turning = (turn_rad_s * axes[1].speed_m_s, -turn_rad_s * axes[0].speed_m_s)
        centripetal = (-turn_rad_s * axes[1].reference_m_s, turn_rad_s * axes[0].reference_m_s)
        forces = (None, None) if force_m_s2 is None else force_m_s2
        asked = [0.0, 0.0]
        for i, axis in enumerate(axes):
            told_m_s = None if measured_m_s is None else measured_m_s[i]
            outside = axis.observe(told_m_s, forces[i], turning[i], dt_s, self._drifts[i].correction_m_s)
            wish = axis.wish(wanted[i], outside, dt_s)
            asked[i] = axis.bounded(wish, wanted[i], outside, dt_s) + centripetal[i]
        x, y = _shortened(asked[0], asked[1], self._max_acceleration)
        axes[0].ask(x)
        axes[1].ask(y)
        return x, y


def _shortened(x: float, y: float, longest: float) -> tuple[float, float]:
    # The same direction, no longer than this.
    size = math.hypot(x, y)
    return (x, y) if size <= longest else (x * longest / size, y * longest / size)

"""A vehicle's attitude from its gyroscopes and accelerometers; values in, values out.

Rates are integrated; the accelerometers, less the acceleration of the reported velocity, draw roll and pitch back over
seconds (a complementary filter). On a real AR.Drone in moving air the error is 0.5 degrees where that of its own
attitude is 5 (docs/explanation/estimation.md 9.2).
"""

import math
from collections import deque
from dataclasses import dataclass

from groundstation.bus.messages import Vector3
from groundstation.estimation.gyro_bias import GYRO_WANDER, GyroBias
from groundstation.geometry.angles import wrap
from groundstation.geometry.stabilized_frame import STANDARD_GRAVITY_M_S2
from groundstation.time_units import NS_PER_MS, NS_PER_S

_LEVEL_S, _STANDING_S = 4.0, 0.5  # accelerometers draw the tilt back over this: in flight, on the ground
_SMOOTH_S = 0.3  # velocities are smoothed over this before they are differentiated
_SILENT_S = 0.3  # after this silence the acceleration counts as zero
_GAP_S = 0.5  # nothing is integrated across a longer one
_RESTARTED_S = 5.0  # after a longer silence a vehicle may have a new battery, and another gyro bias
_FRESH_NS = 100 * NS_PER_MS  # largest time between a sample and a time that it is used for
# Between two samples the mean rate is off by their difference over the root of three: found with real rates, whose
# vibration is faster than most sampling. Averaged over this [s].
_SAMPLING, _AVERAGED_S = 1.0 / 3.0, 1.0
_KEPT = 256  # samples: more than a second
# A specific force beyond these is a blow, not gravity [m/s^2]; a gain error of 8 % is usual.
_LEAST_FORCE, _MOST_FORCE = 0.6 * STANDARD_GRAVITY_M_S2, 1.4 * STANDARD_GRAVITY_M_S2


@dataclass(frozen=True, slots=True)
class Attitude:
    """Roll, pitch and heading of a vehicle [rad; odom].

    resets: rises where the heading's increment is void; attitude_std_rad: of roll and of pitch; yaw_std_rad: random
    walk of the heading per root second.
    """

    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    resets: int
    attitude_std_rad: float
    yaw_std_rad: float


class InertialAttitude:
    """The attitude of one vehicle; velocity_scale: its true speed over its reported speed."""

    def __init__(self, velocity_scale: float = 1.0) -> None:
        self._scale = velocity_scale
        self._bias = GyroBias()
        self._kept: deque[tuple[int, float, float, float]] = deque(maxlen=_KEPT)
        self._roll = self._pitch = self._yaw = 0.0
        self._resets = 0
        self._stamp_ns: int | None = None
        self._velocity = (0.0, 0.0)
        self._acceleration = (0.0, 0.0)
        self._velocity_ns: int | None = None
        self._rate = (0.0, 0.0, 0.0)
        self._sampling = 0.0  # density of the heading's error by the samples' distance [rad^2/s]

    def take_imu(self, stamp_ns: int, rates_rad_s: Vector3, force_m_s2: Vector3, standing: bool) -> None:
        """Take body rates and specific force [base, FLU]; standing: whether it reports to be on the ground."""
        elapsed_s = math.inf if self._stamp_ns is None else (stamp_ns - self._stamp_ns) / NS_PER_S
        if elapsed_s <= 0.0:
            return
        if elapsed_s > _RESTARTED_S:
            self._bias = GyroBias()
        if standing:
            self._bias.take_standing(stamp_ns, rates_rad_s)
        else:
            self._bias.leave_ground()
        unbiased = tuple(rate - bias for rate, bias in zip(rates_rad_s, self._bias.rad_s, strict=True))
        if elapsed_s > _GAP_S:
            self._begin(force_m_s2)
        else:
            within_s = _STANDING_S if standing else _LEVEL_S
            self._turn(unbiased[0], unbiased[1], unbiased[2], elapsed_s)
            self._note_sampling(unbiased[2], elapsed_s)
            self._bias.go_on(elapsed_s, within_s)
            self._level(force_m_s2, stamp_ns, elapsed_s, within_s)
        self._stamp_ns, self._rate = stamp_ns, (unbiased[0], unbiased[1], unbiased[2])
        self._kept.append((stamp_ns, self._roll, self._pitch, self._yaw))

    def take_velocity(self, stamp_ns: int, velocity_m_s: Vector3) -> None:
        """Take a reported velocity [base_stabilized]: its change is not taken for tilt."""
        forward, left = self._scale * velocity_m_s[0], self._scale * velocity_m_s[1]
        elapsed_s = math.inf if self._velocity_ns is None else (stamp_ns - self._velocity_ns) / NS_PER_S
        if elapsed_s <= 0.0:
            return
        self._velocity_ns = stamp_ns
        if elapsed_s > _SILENT_S:
            self._velocity, self._acceleration = (forward, left), (0.0, 0.0)
            return
        share, (vx, vy) = elapsed_s / (_SMOOTH_S + elapsed_s), self._velocity
        self._velocity = vx, vy = vx + share * (forward - vx), vy + share * (left - vy)
        turn = self._rate[2]
        self._acceleration = (forward - vx) / _SMOOTH_S - turn * vy, (left - vy) / _SMOOTH_S + turn * vx

    def take_heading(self, stamp_ns: int, yaw_rad: float, reset: int) -> None:
        """Take the vehicle's own heading: a doubtful reference, from which only the gyro's bias learns slowly."""
        if self._is_fresh(stamp_ns):
            self._bias.take_heading(stamp_ns, yaw_rad, self._yaw, reset + self._resets)

    def take_sight(self, camera: str, stamp_ns: int, yaw_rad: float, variance: float) -> None:
        """Take the heading that a fixed camera shows, from any zero: the gyro's bias learns from its change."""
        at = self._at(stamp_ns)
        if at is not None:
            self._bias.take_sight(camera, stamp_ns, yaw_rad, variance, at[2])

    def at(self, stamp_ns: int) -> Attitude | None:
        """Return the attitude at a time; None if all samples are too far from it."""
        tilted = self._at(stamp_ns)
        if tilted is None:
            return None
        missed = math.sqrt(max(0.0, self._sampling - GYRO_WANDER**2))
        yaw_std_rad = math.hypot(self._bias.yaw_std_rad, missed)
        return Attitude(*tilted, self._resets, self._bias.tilt_std_rad, yaw_std_rad)

    def tilt_at(self, stamp_ns: int) -> tuple[float, float] | None:
        """Return (roll, pitch) at a time, as `at` does."""
        tilted = self._at(stamp_ns)
        return None if tilted is None else tilted[:2]

    def _at(self, stamp_ns: int) -> Vector3 | None:
        """Return (roll, pitch, yaw) at a time between two samples, or at the present rates within 0.1 s of one."""
        after: tuple[int, float, float, float] | None = None
        for sample in reversed(self._kept):
            if sample[0] <= stamp_ns:
                return self._between(sample, after, stamp_ns)
            after = sample
        return None if after is None or after[0] - stamp_ns > _FRESH_NS else after[1:]

    def _between(
        self, before: tuple[int, float, float, float], after: tuple[int, float, float, float] | None, stamp_ns: int
    ) -> Vector3 | None:
        elapsed_ns = stamp_ns - before[0]
        if after is None:
            return self._ahead(before, elapsed_ns / NS_PER_S) if elapsed_ns <= _FRESH_NS else None
        if min(elapsed_ns, after[0] - stamp_ns) > _FRESH_NS:
            return None
        share = elapsed_ns / (after[0] - before[0])
        roll, pitch, yaw = (
            here + share * wrap(there - here) for here, there in zip(before[1:], after[1:], strict=True)
        )
        return roll, pitch, wrap(yaw)

    def _ahead(self, newest: tuple[int, float, float, float], elapsed_s: float) -> Vector3:
        roll, pitch, yaw = newest[1:]
        roll_rate, pitch_rate, yaw_rate = self._rates_of_angles(*self._rate)
        return roll + elapsed_s * roll_rate, pitch + elapsed_s * pitch_rate, wrap(yaw + elapsed_s * yaw_rate)

    def _is_fresh(self, stamp_ns: int) -> bool:
        return self._stamp_ns is not None and abs(stamp_ns - self._stamp_ns) <= _FRESH_NS

    def _begin(self, force: Vector3) -> None:
        """Begin (again) from one sample; the heading continues, but with a void increment."""
        self._roll, self._pitch = _tilt_of(force)
        self._bias.begin()
        self._resets += 1

    def _turn(self, wx: float, wy: float, wz: float, elapsed_s: float) -> None:
        """Integrate body rates."""
        roll_rate, pitch_rate, yaw_rate = self._rates_of_angles(wx, wy, wz)
        self._yaw = wrap(self._yaw + elapsed_s * yaw_rate)
        self._roll = wrap(self._roll + elapsed_s * roll_rate)
        self._pitch += elapsed_s * pitch_rate

    def _note_sampling(self, wz: float, elapsed_s: float) -> None:
        """Learn how much of the turn happens unseen between two samples."""
        density = _SAMPLING * elapsed_s * (wz - self._rate[2]) ** 2
        self._sampling += elapsed_s / (elapsed_s + _AVERAGED_S) * (density - self._sampling)

    def _rates_of_angles(self, wx: float, wy: float, wz: float) -> Vector3:
        """Return how fast roll, pitch and yaw change at these body rates."""
        sine, cosine, tangent = math.sin(self._roll), math.cos(self._roll), math.tan(self._pitch)
        about_vertical = wy * sine + wz * cosine
        return wx + about_vertical * tangent, wy * cosine - wz * sine, about_vertical / math.cos(self._pitch)

    def _level(self, force: Vector3, stamp_ns: int, elapsed_s: float, within_s: float) -> None:
        """Draw roll and pitch towards the accelerometers' values, and the gyroscopes' bias with them."""
        if not _LEAST_FORCE < math.hypot(*force) < _MOST_FORCE:
            return
        roll, pitch = _tilt_of(force)
        if self._velocity_ns is not None and abs(stamp_ns - self._velocity_ns) < _SILENT_S * NS_PER_S:
            roll -= self._acceleration[1] / STANDARD_GRAVITY_M_S2
            pitch += self._acceleration[0] / STANDARD_GRAVITY_M_S2
        ahead_rad = wrap(roll - self._roll), pitch - self._pitch
        roll_rad, pitch_rad = self._bias.take_tilt(elapsed_s, within_s, ahead_rad)
        self._roll = wrap(self._roll + roll_rad)
        self._pitch += pitch_rad


def _tilt_of(force: Vector3) -> tuple[float, float]:
    """Return (roll, pitch) of a vehicle that does not accelerate."""
    return math.atan2(force[1], force[2]), math.atan2(-force[0], math.hypot(force[1], force[2]))

"""Odometry condensed by step and robot, in a ring: samples of one step are added in any order."""

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.measurement import OdometrySample
from groundstation.estimation.records import CondensedOdometry

_FIELDS = CondensedOdometry.dtype.names or ()
_WORDS = len(_FIELDS)
_SUM_VX, _SUM_VY, _SUM_VZ, _SUM_RATE, _VELOCITY_COUNT = map(
    _FIELDS.index, ("sum_vx", "sum_vy", "sum_vz", "sum_rate", "velocity_count")
)
_NEWEST_AT, _NEWEST_YAW, _NEWEST_RESET, _NEWEST_ROLL, _NEWEST_PITCH, _ATTITUDE_STD, _YAW_STD, _VELOCITY_STD = map(
    _FIELDS.index,
    (
        "newest_at", "newest_yaw", "newest_reset", "newest_roll", "newest_pitch",
        "newest_attitude_std", "newest_yaw_std", "newest_velocity_std",
    ),
)  # fmt: skip
_HEIGHT_SUM, _HEIGHT_COUNT = map(_FIELDS.index, ("height_sum", "height_count"))


class OdometryRing:
    """`rows` (steps, robots) as the filter reads them; a step is one modulo the length of the ring."""

    def __init__(self, steps: int, robots: int) -> None:
        self.rows = CondensedOdometry.rows(steps, robots)
        self._robots = robots
        empty = CondensedOdometry.rows(robots)
        empty["newest_at"] = -1.0
        self._empty: Array = np.asarray(empty).view(np.float64)
        # The same numbers by step, and in one row: Python reads and writes single ones there in half of numpy's time.
        self._steps: Array = np.asarray(self.rows).view(np.float64)
        self._steps[:] = self._empty
        self._words = self._steps.data.cast("B").cast("d")

    def __len__(self) -> int:
        return len(self.rows)

    def clear(self, step: int) -> None:
        """Forget the odometry of a step."""
        self._steps[step % len(self._steps)] = self._empty

    def add_velocity(self, step: int, robot: int, motion: OdometrySample) -> None:
        """Take the velocity and turn rate of a sample."""
        words, first = self._words, self._first(step, robot)
        vx, vy, vz = motion.velocity_m_s
        words[first + _SUM_VX] += vx
        words[first + _SUM_VY] += vy
        words[first + _SUM_VZ] += vz
        words[first + _SUM_RATE] += motion.yaw_rate_rad_s
        words[first + _VELOCITY_COUNT] += 1.0

    def add_attitude(self, step: int, robot: int, motion: OdometrySample, at_ns: int) -> None:
        """Take the attitude of a sample if none newer of the step has arrived."""
        words, first = self._words, self._first(step, robot)
        at = float(at_ns)
        if at >= words[first + _NEWEST_AT]:
            words[first + _NEWEST_YAW], words[first + _NEWEST_AT] = motion.yaw_rad, at
            words[first + _NEWEST_RESET] = float(motion.reset)
            words[first + _NEWEST_ROLL], words[first + _NEWEST_PITCH] = motion.roll_rad, motion.pitch_rad
            words[first + _ATTITUDE_STD], words[first + _YAW_STD] = motion.attitude_std_rad, motion.yaw_std_rad
            words[first + _VELOCITY_STD] = motion.velocity_std_m_s

    def add_height(self, step: int, robot: int, height_m: float) -> None:
        """Take a height."""
        first = self._first(step, robot)
        self._words[first + _HEIGHT_SUM] += height_m
        self._words[first + _HEIGHT_COUNT] += 1.0

    def _first(self, step: int, robot: int) -> int:
        return (step % len(self.rows) * self._robots + robot) * _WORDS

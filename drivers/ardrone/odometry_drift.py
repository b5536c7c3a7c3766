"""The odometry error of one horizontal axis, as cameras see it. Pure.

To the velocity loop a drifting velocity looks like any other. Cameras show the difference half a second later: they see
the displacement over that time (`drivers/control_error.py`).
"""

import math
from collections import deque
from dataclasses import dataclass

from drivers.ardrone.velocity_axis import SEEN_TICKS, clamp


@dataclass(frozen=True, slots=True)
class DriftLimits:
    """Figures of the drift's estimate.

    ticks: calls over which cameras average. smoothing_s, fades_s: time constants of the difference, and without
    cameras. tolerated_m_s: effect of noise, a wrong scale, a slightly misleading floor: a drift begins beyond it, and
    ends below half of it; most_m_s: largest correction; step_m_s: largest difference that counts at once, so that a
    frozen picture is noticed before it moves a drone.
    """

    ticks: int = SEEN_TICKS
    smoothing_s: float = 0.5
    fades_s: float = 2.0
    tolerated_m_s: float = 0.2
    most_m_s: float = 0.6
    step_m_s: float = 0.3


class OdometryDrift:
    """The measured speed less the one that cameras see, smoothed."""

    def __init__(self, limits: DriftLimits) -> None:
        self._limits = limits
        self.reset()

    def reset(self) -> None:
        """Forget the drift: the drone stands, or holds its place by itself."""
        self._measured: deque[float] = deque(maxlen=self._limits.ticks)
        self._off_m_s = 0.0
        self._drifts = False

    def compare(self, measured_m_s: float, seen_m_s: float | None, dt_s: float) -> None:
        """Take a measured speed and the mean one that cameras saw, or None."""
        limits = self._limits
        self._measured.append(measured_m_s)
        if seen_m_s is None:
            self._off_m_s *= math.exp(-dt_s / limits.fades_s)
        elif len(self._measured) == limits.ticks:
            change = sum(self._measured) / limits.ticks - seen_m_s - self._off_m_s
            self._off_m_s += min(1.0, dt_s / limits.smoothing_s) * clamp(change, limits.step_m_s)
        self._drifts = math.fabs(self._off_m_s) > limits.tolerated_m_s * (0.5 if self._drifts else 1.0)

    @property
    def correction_m_s(self) -> float:
        """Return the error of the measured speed [m/s]."""
        return clamp(self._off_m_s, self._limits.most_m_s) if self._drifts else 0.0

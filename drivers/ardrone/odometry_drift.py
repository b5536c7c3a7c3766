"""What the odometry of one horizontal axis is off by, as cameras see it. Pure.

A drifting velocity looks like any other to the loop that flies by it. Cameras know better, half a second later: they
see the displacement over that time (`drivers/control_error.py`).
"""

import math
from collections import deque
from dataclasses import dataclass

from drivers.ardrone.velocity_axis import SEEN_TICKS, clamp


@dataclass(frozen=True, slots=True)
class DriftLimits:
    """ticks: calls over which cameras see a mean. smoothing_s, fades_s: of the difference, and without cameras.
    tolerated_m_s: noise, a wrong scale, a floor that misleads a little: a drift begins beyond it, and is over below
    half of it; most_m_s: largest correction; step_m_s: largest difference that counts at once, so that a picture that
    hangs is found before it moves anything.
    """

    ticks: int = SEEN_TICKS
    smoothing_s: float = 0.5
    fades_s: float = 2.0
    tolerated_m_s: float = 0.2
    most_m_s: float = 0.6
    step_m_s: float = 0.3


class OdometryDrift:
    """Measured speed less the one that cameras see, smoothed."""

    def __init__(self, limits: DriftLimits) -> None:
        self._limits = limits
        self.reset()

    def reset(self) -> None:
        """Forget it: the drone stands, or holds its place by itself."""
        self._measured: deque[float] = deque(maxlen=self._limits.ticks)
        self._off_m_s = 0.0
        self._drifts = False

    def compare(self, measured_m_s: float, seen_m_s: float | None, dt_s: float) -> None:
        """Take a measured speed and the mean one that cameras saw, None if they did not."""
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
        """Return how much of a measured speed is not true [m/s]."""
        return clamp(self._off_m_s, self._limits.most_m_s) if self._drifts else 0.0

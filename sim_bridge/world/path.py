"""Closed curves for targets, and a point that runs along them at constant speed."""

import math
from typing import NamedTuple

from sim_bridge.target_paths import FigureEight


class PathPoint(NamedTuple):
    """Place [m; world], heading [rad] and curvature [1/m] of a curve."""

    x: float
    y: float
    heading: float
    curvature: float


class EightPath:
    """The lemniscate x = a sin(phase), y = b sin(2 phase) about its centre."""

    def __init__(self, figure: FigureEight) -> None:
        self.speed_m_s = figure.speed_m_s
        self.phase = math.tau * figure.start_phase
        self._a, self._b = figure.half_length_m, figure.half_width_m
        self._centre = figure.centre_m

    def point(self) -> PathPoint:
        """Return the running point."""
        return self._at(self.phase)

    def advance(self, distance_m: float) -> None:
        """Run on along the curve."""
        slope_x, slope_y = self._slope(self.phase)
        self.phase = math.remainder(self.phase + distance_m / math.hypot(slope_x, slope_y), math.tau)

    def jump_to_nearest(self, x: float, y: float) -> None:
        """Continue from the point of the curve that is nearest to a place."""
        phases = (math.tau * n / 256 for n in range(256))
        self.phase = min(phases, key=lambda phase: math.hypot(self._at(phase).x - x, self._at(phase).y - y))

    def _slope(self, phase: float) -> tuple[float, float]:
        return self._a * math.cos(phase), 2.0 * self._b * math.cos(2.0 * phase)

    def _at(self, phase: float) -> PathPoint:
        dx, dy = self._slope(phase)
        ddx, ddy = -self._a * math.sin(phase), -4.0 * self._b * math.sin(2.0 * phase)
        return PathPoint(
            self._centre[0] + self._a * math.sin(phase),
            self._centre[1] + self._b * math.sin(2.0 * phase),
            math.atan2(dy, dx),
            (dx * ddy - dy * ddx) / math.hypot(dx, dy) ** 3,
        )

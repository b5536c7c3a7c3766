"""Compares a marker's distance by its size with that by height sensors, to detect a wrong print size."""

import math
from collections import deque
from statistics import median

import numpy as np
from numpy.typing import NDArray

from groundstation.time_units import NS_PER_S

_LEAST_DROP_M = 0.5
_KEPT, _LEAST_SAMPLES, _LEAST_SPAN_NS = 120, 40, 3 * NS_PER_S
# Errors that do not average out: a height sensor's offset [m], and roll and pitch [rad] times the distance aside.
_HEIGHT_STD_M, _ATTITUDE_STD_RAD = 0.05, math.radians(2.0)
_SIGMAS, _LEAST_DEVIATION = 3.0, math.log(1.08)


class SizeCheck:
    """Collects ratios for one marker; `ratio` is set once they contradict the size for three seconds."""

    def __init__(self) -> None:
        self._ratios: deque[tuple[int, float, float]] = deque(maxlen=_KEPT)

    def add(self, stamp_ns: int, relative_m: NDArray[np.float64], drop_m: float | None) -> None:
        """Take in a sighting: marker relative to the camera [m; z up], and its depth below by height sensors [m]."""
        seen_drop = -float(relative_m[2])
        if drop_m is None or drop_m < _LEAST_DROP_M or seen_drop <= 0.0:
            return
        aside = math.hypot(relative_m[0], relative_m[1]) / seen_drop
        std = math.hypot(_HEIGHT_STD_M / drop_m, _ATTITUDE_STD_RAD * aside)
        self._ratios.append((stamp_ns, math.log(seen_drop / drop_m), std))

    @property
    def ratio(self) -> float | None:
        """Return by how much the marker seems farther than it is, or None while that agrees with its size."""
        if len(self._ratios) < _LEAST_SAMPLES or self._ratios[-1][0] - self._ratios[0][0] < _LEAST_SPAN_NS:
            return None
        deviation = median(ratio for _, ratio, _ in self._ratios)
        std = math.fsum(std for _, _, std in self._ratios) / len(self._ratios)
        return math.exp(deviation) if abs(deviation) > max(_LEAST_DEVIATION, _SIGMAS * std) else None

"""The latest sightings of standing drones, condensed to medians. Pure."""

from collections import deque
from collections.abc import Collection

import numpy as np

from groundstation.bus.messages import RangeObservation, RelativeObservation
from groundstation.preflight.stand import PadSighting
from groundstation.time_units import NS_PER_S

_WINDOW_NS = 12 * NS_PER_S
_MOST = 60
LEAST = 8
"""Least number of sightings of one drone by one camera for a median."""
# Variance of a median relative to that of a mean, for many normal samples.
_MEDIAN_COST = 1.57


class PadRecord:
    """The latest sightings of each drone by each sensor fixed in the room."""

    def __init__(self, cameras: Collection[str]) -> None:
        self._cameras = frozenset(cameras)
        self._seen: dict[tuple[str, str], deque[tuple[int, tuple[float, ...]]]] = {}

    def see(self, sighting: RelativeObservation | RangeObservation, now_ns: int) -> None:
        """Take a sighting, or ranges that determine a place; those by drones are ignored."""
        if sighting.observer in self._cameras and sighting.position_m is not None:
            yaw = sighting.yaw_rad if isinstance(sighting, RelativeObservation) else None
            rows = self._seen.setdefault((sighting.observer, sighting.subject), deque(maxlen=_MOST))
            rows.append((now_ns, (*sighting.position_m, float("nan") if yaw is None else yaw)))

    def forget(self, drone: str) -> None:
        """Discard the sightings of a drone that flew, or was carried."""
        for pair in [pair for pair in self._seen if pair[1] == drone]:
            del self._seen[pair]

    def medians(self, now_ns: int) -> tuple[PadSighting, ...]:
        """Return a median for each pair of sensor and drone with enough recent sightings."""
        found = []
        for (camera, drone), rows in self._seen.items():
            fresh = np.array([row for at_ns, row in rows if now_ns - at_ns < _WINDOW_NS])
            if len(fresh) >= LEAST:
                found.append(_median(camera, drone, fresh))
        return tuple(found)


def _median(camera: str, drone: str, rows: np.ndarray) -> PadSighting:
    """Return the median of rows (n, 4); its spread comes from quartiles, which single wrong rows do not move."""
    rows = rows.copy()
    known = rows[np.isfinite(rows[:, 3]), 3]
    if len(known) >= LEAST:
        first = known[0]
        rows[:, 3] = first + np.remainder(rows[:, 3] - first + np.pi, 2.0 * np.pi) - np.pi
        middle = np.nanmedian(rows, axis=0)
    else:
        middle = np.array([*np.median(rows[:, :3], axis=0), np.nan])
    low, high = np.nanpercentile(rows[:, : 4 if len(known) >= LEAST else 3], (25, 75), axis=0)
    std = np.zeros(4)
    std[: len(low)] = (high - low) / 1.349
    return PadSighting(camera, drone, middle[:3], float(middle[3]), np.diag(_MEDIAN_COST * std**2 / len(rows)))

"""The heights of the drones' markers as seen by fixed cameras. Pure."""

import statistics
from collections import deque
from dataclasses import dataclass

from groundstation.bus.messages import Vector3
from groundstation.time_units import NS_PER_S

# The median of five ignores one or two wrong sightings, and is a fifth of a second late at 15 pictures a second. An
# overloaded machine delivered two a second.
_WINDOW_NS = 2 * NS_PER_S
_MOST, _LEAST = 5, 3


@dataclass(frozen=True, slots=True)
class FixedCamera:
    """The place of a fixed camera: height_m above the floor; up: the world's z axis [camera_optical]."""

    height_m: float
    up: Vector3

    def height_of(self, position_m: Vector3) -> float:
        """Return the height of a point [camera_optical] above the floor [m]."""
        return self.height_m + sum(a * b for a, b in zip(self.up, position_m, strict=True))


class MarkerHeight:
    """The height of one marker above the floor: the median of its last sightings."""

    def __init__(self) -> None:
        self._sightings: deque[tuple[int, float]] = deque(maxlen=_MOST)

    def see(self, now_ns: int, height_m: float) -> None:
        """Take a sighting."""
        self._sightings.append((now_ns, height_m))

    def forget(self) -> None:
        """Start anew: past places of the marker do not count any more."""
        self._sightings.clear()

    def at(self, now_ns: int) -> float | None:
        """Return the height [m], or None if the marker is not in view now."""
        heights = [height_m for seen_ns, height_m in self._sightings if now_ns - seen_ns < _WINDOW_NS]
        return statistics.median(heights) if len(heights) >= _LEAST else None

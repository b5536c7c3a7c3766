"""Recognises pictures that show nothing new although something moves: a camera or a stream that hangs. Pure."""

import math
from collections import deque
from collections.abc import Mapping

import numpy as np

from groundstation.arrays import Array, Image
from groundstation.time_units import NS_PER_MS

# Of these rows alone, pictures are compared first: noise tells those of a working camera apart.
_EVERY_ROW = 32
_REMEMBERED = 8
# Codecs make a marker's centre tremble by less; a flying vehicle never keeps one so steady while it tilts.
_STEADY_PX = 0.6
# In 88 recorded flights markers stood so steady in a living picture for 0.3 s at most; meanwhile the vehicle's tilt
# must have moved the picture by this much [px].
_LASTING_NS, _TURNED_PX = 800 * NS_PER_MS, 4.0


class UnchangedPictures:
    """Recognises pictures that equal one of the last eight different ones in every pixel; a working camera's never do.

    A stream that hangs may repeat several in turn.
    """

    def __init__(self) -> None:
        self._shown: deque[tuple[bytes, Image]] = deque(maxlen=_REMEMBERED)
        self._newest_ns = 0

    def since_ns(self, picture: Image, exposure_ns: int) -> int:
        """Return the exposure of the newest picture that was none of those before it: this one, if it is new [ns]."""
        some = picture[::_EVERY_ROW].tobytes()
        if not any(rows == some and np.array_equal(shown, picture) for rows, shown in self._shown):
            self._shown.append((some, picture))
            self._newest_ns = exposure_ns
        return self._newest_ns


class SteadyMarkers:
    """Recognises a hanging camera whose encoder still runs, so that no two pictures are equal.

    All markers stand still although its vehicle is in the air and its tilt changes. focal_px: of the camera.
    """

    def __init__(self, focal_px: float) -> None:
        self._focal_px = focal_px
        self._begin(0, {})

    def _begin(self, exposure_ns: int, centres: Mapping[str, Array]) -> None:
        self._since_ns, self._centres = exposure_ns, dict(centres)
        self._least, self._most = np.full(2, math.inf), np.full(2, -math.inf)

    def since_ns(self, exposure_ns: int, corners: Mapping[str, Array], tilt_rad: tuple[float, float] | None) -> int:
        """Return the exposure since which the picture has hung, or this one [ns].

        corners (n, 2) [px] of the markers in the picture; tilt_rad: roll and pitch, None for a vehicle on the floor.
        """
        if not corners and tilt_rad is not None:  # missed or out of view: the next pictures decide
            return exposure_ns
        centres = {entity: seen.mean(axis=0) for entity, seen in corners.items()}
        moved = [math.dist(at, self._centres[who]) > _STEADY_PX for who, at in centres.items() if who in self._centres]
        if tilt_rad is None or not moved or any(moved):
            self._begin(exposure_ns, centres)
            return exposure_ns
        self._least, self._most = np.minimum(self._least, tilt_rad), np.maximum(self._most, tilt_rad)
        turned_px = float((self._most - self._least).max()) * self._focal_px
        hangs = turned_px > _TURNED_PX and exposure_ns - self._since_ns >= _LASTING_NS
        return self._since_ns if hangs else exposure_ns

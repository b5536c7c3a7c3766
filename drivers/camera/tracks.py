"""Boards followed from picture to picture: where to look next, and the identity of each between sure readings."""

from dataclasses import dataclass, field

import numpy as np

from drivers.camera.detect import Find, Window, spacing_px, window_around
from drivers.camera.markers import BarReading
from drivers.camera.prediction import Prediction
from groundstation.arrays import Array
from groundstation.time_units import NS_PER_MS, NS_PER_S

_MARGIN_SQUARES = 1.6
# A window grows with the time since the last detection, for motion beyond constant velocity.
_UNREST_PX_S = 120.0
_MOST_UNREST_PX = 45.0
_LIFETIME_NS = 450 * NS_PER_MS
_MOST_MISSES = 5
# An identity outlives the last sure reading by this much of unbroken tracking.
_IDENTITY_NS = 2 * NS_PER_S


# A board that is found farther from where it should be may be its neighbour: cards side by side are 4.8 squares apart.
_SAME_SQUARES = 2.0
# Below this margin a new board's code must be read twice: far away, one reading in seventy is wrong with margin > 1.
_AT_ONCE_MARGIN = 2.0


@dataclass(slots=True)
class Track:
    """One board: last corners (12, 2) [px] and their time, image velocity [px/s], identity if known.

    pending: a code that another sure reading would confirm.
    foreseen: its centre by the belief in the picture of the last corners [px].
    """

    corners: Array
    stamp_ns: int
    velocity: Array = field(default_factory=lambda: np.zeros(2))
    code: int | None = None
    pending: int | None = None
    margin: float = 0.0
    read_ns: int = 0
    misses: int = 0
    foreseen: Array | None = None

    def expected_corners(self, stamp_ns: int, prediction: Prediction | None = None) -> Array:
        """Return where the corners should be at a later time.

        They move as the belief does, which includes the turning of both vehicles; without it, at constant image
        velocity.
        """
        if prediction is not None and self.foreseen is not None:
            return np.asarray(self.corners + (prediction.centre - self.foreseen))
        return np.asarray(self.corners + self.velocity * ((stamp_ns - self.stamp_ns) / NS_PER_S))

    def window(self, stamp_ns: int, shape: tuple[int, ...], prediction: Prediction | None = None) -> Window | None:
        """Return the window to look in, or None when that has left the picture."""
        unrest = min(_MOST_UNREST_PX, _UNREST_PX_S * (stamp_ns - self.stamp_ns) / NS_PER_S)
        margin = _MARGIN_SQUARES * spacing_px(self.corners) + unrest
        return window_around(self.expected_corners(stamp_ns, prediction), margin, shape)

    def accepts(self, find: Find, stamp_ns: int, prediction: Prediction | None = None) -> bool:
        """Return whether a find may be this board: near where it should be and of about its size."""
        own, other = spacing_px(self.corners), spacing_px(find.corners)
        return self._off_px(find, stamp_ns, prediction) < 2.5 * own + _MOST_UNREST_PX and 0.6 < other / own < 1.7

    def follow(self, find: Find, stamp_ns: int, prediction: Prediction | None = None) -> None:
        """Take over a new detection.

        One that is not where the board should be must be read before it has an identity; a sure reading that agrees
        with the former one is enough.
        """
        jumps = self._off_px(find, stamp_ns, prediction) > _SAME_SQUARES * spacing_px(self.corners)
        if jumps and self.code is not None:
            self.code, self.margin, self.pending = None, 0.0, self.code
        seconds = (stamp_ns - self.stamp_ns) / NS_PER_S
        if seconds > 0.0:
            self.velocity = (find.corners - self.corners).mean(axis=0) / seconds
        self.corners, self.stamp_ns, self.misses = find.corners, stamp_ns, 0
        self.foreseen = prediction.centre if prediction is not None else None

    def _off_px(self, find: Find, stamp_ns: int, prediction: Prediction | None) -> float:
        """Return how far a find is from where the board should be [px]."""
        return float(np.hypot(*(find.centre - self.expected_corners(stamp_ns, prediction).mean(axis=0))))

    def miss(self) -> None:
        """Remember that the board was not where it should be."""
        self.misses += 1

    def is_lost(self, now_ns: int) -> bool:
        """Return whether it is no longer worth looking for."""
        return self.misses > _MOST_MISSES or now_ns - self.stamp_ns > _LIFETIME_NS

    def identify(self, reading: BarReading | None, stamp_ns: int, least_margin: float) -> None:
        """Take in a reading of the bar: a sure one decides, at once or confirmed by a second one.

        A sure contradiction leaves the board unknown, and so does a long time without any sure reading.
        """
        if reading is None or not reading.is_sure(least_margin):
            if self.code is not None and stamp_ns - self.read_ns > _IDENTITY_NS:
                self.code, self.margin = None, 0.0
            return
        if self.code not in (None, reading.code):
            self.code, self.margin, self.pending = None, 0.0, None
            return
        if self.code is None and reading.margin < _AT_ONCE_MARGIN and self.pending != reading.code:
            self.pending = reading.code
            return
        self.code, self.margin, self.read_ns, self.pending = reading.code, reading.margin, stamp_ns, None

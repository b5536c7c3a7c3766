"""Recognises pictures that repeat their predecessor to the last pixel: what lives, or moves, never does."""

import numpy as np

from groundstation.arrays import Image
from groundstation.time_units import NS_PER_S


class UnchangedPictures:
    """Call `first_shown_ns` with each picture, in order; keeps one picture."""

    def __init__(self) -> None:
        self._picture: Image | None = None
        self._since_ns = self._newest_ns = 0

    def first_shown_ns(self, picture: Image, exposure_ns: int) -> int:
        """Return the exposure of the first of the equal pictures in a row that end with this one [ns]."""
        self._newest_ns = exposure_ns
        if self._picture is None or not np.array_equal(self._picture, picture):
            self._picture, self._since_ns = picture, exposure_ns
        return self._since_ns

    @property
    def lasting_s(self) -> float:
        """Return for how long pictures have come that show nothing new [s]."""
        return (self._newest_ns - self._since_ns) / NS_PER_S

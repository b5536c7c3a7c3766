"""Judges whether a picture could show a marker: a dark, white or fogged one proves nobody's absence. Pure."""

import math
from collections import deque
from statistics import median

import cv2
import numpy as np

from groundstation.arrays import Image

# Mean of a picture [share of white]: with 6 % some rendered boards are found, with 5 % none.
_DARKEST, _WHITEST = 0.06, 0.94
# Least contrast [grey levels] of a scene not yet known: good pictures of the plainest floor have 14, noise alone 2.
_LEAST_CONTRAST = 4.0
# Least share of the usual contrast of pictures that show a marker: boards are found at 0.12 of a good picture's, and
# none at 0.09. A camera that moves sees parts of a floor with a tenth of the contrast of others.
_SHARE_STANDING, _SHARE_MOVING = 0.1, 0.05
_REMEMBERED = 21
# The means of this many squares along a picture's width have little noise left, and still show floors and bodies.
_COLUMNS = 40


class ClearPictures:
    """Ask `is_clear` for each searched picture of one camera; those that show a marker teach it what is enough.

    stands: the camera always sees the same scene.
    """

    def __init__(self, *, stands: bool) -> None:
        self._share = _SHARE_STANDING if stands else _SHARE_MOVING
        self._darkest, self._whitest = _DARKEST, _WHITEST
        self._least = _LEAST_CONTRAST
        # A hull before the lens, or a strip of sun, gives single pictures ten times a plain floor's contrast.
        self._usual: deque[float] = deque(maxlen=_REMEMBERED)

    def is_clear(self, picture: Image, shows_marker: bool) -> bool:
        """Return whether a marker would be found in a grey picture, as far as light and contrast tell."""
        light, contrast = _light_and_contrast(picture)
        if shows_marker:
            self._darkest, self._whitest = min(self._darkest, light), max(self._whitest, light)
            self._least = min(self._least, contrast)
            self._usual.append(contrast)
            return True
        usual = median(self._usual) if self._usual else 0.0
        return self._darkest <= light <= self._whitest and contrast >= max(self._least, self._share * usual)


def _light_and_contrast(picture: Image) -> tuple[float, float]:
    """Return the mean of a picture [share of white], and its contrast [grey levels].

    The contrast leaves out the darkest and the brightest twentieth: markers and bodies, which come and go.
    """
    side = max(1, math.ceil(picture.shape[1] / _COLUMNS))
    columns, rows = max(1, picture.shape[1] // side), max(1, picture.shape[0] // side)
    whole = picture[: rows * side, : columns * side].astype(np.float32)
    means = cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)
    dark, bright = np.percentile(means, (5.0, 95.0))
    return float(means.mean()) / 255.0, float(bright - dark)

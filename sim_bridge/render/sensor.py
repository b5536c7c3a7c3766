"""The image sensor: grey-level noise from a stored tile, laid at another place for each frame."""

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
_SPARE = 128


class SensorNoise:
    """Adds noise of a given rms [grey levels] without drawing random numbers per pixel and frame."""

    def __init__(self, width: int, height: int, rms: float, random: np.random.Generator) -> None:
        self._active = rms > 0.0
        self._size = (height, width)
        noise = (
            np.rint(random.normal(0.0, rms, (height + _SPARE, width + _SPARE))) if self._active else np.zeros((1, 1))
        )
        # Saturating unsigned additions are many times faster than any signed arithmetic on bytes.
        self._up = np.clip(noise, 0, 255).astype(np.uint8)
        self._down = np.clip(-noise, 0, 255).astype(np.uint8)

    def add(self, picture: Picture, random: np.random.Generator) -> Picture:
        """Return the picture with noise."""
        if not self._active:
            return picture
        row, column = (int(n) for n in random.integers(0, _SPARE, 2))
        part = slice(row, row + self._size[0]), slice(column, column + self._size[1])
        return np.asarray(cv2.subtract(cv2.add(picture, self._up[part]), self._down[part]), dtype=np.uint8)

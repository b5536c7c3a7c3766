"""The image sensor: its light, and its noise from a stored tile at another offset for each frame."""

import cv2
import numpy as np

from groundstation.arrays import Image
from sim_bridge.render.spec import PictureQuality

_SPARE = 128
# The tile holds noise of this rms, so that scaled noise is not all quantisation.
_TILE_RMS = 24.0


class ImageSensor:
    """Turns light into grey levels, without drawing random numbers for each pixel and frame."""

    def __init__(self, width: int, height: int, scenario: PictureQuality, random: np.random.Generator) -> None:
        self._size = (height, width)
        grey = np.arange(256, dtype=np.float64)
        self._light = None if scenario.light == 1.0 else np.clip(grey * scenario.light, 0, 255).astype(np.uint8)
        self._gain = None
        rms = scenario.pixel_noise
        if scenario.shot_noise > 0.0:
            # Read noise and photon noise, whose variance grows with the light; in 1/8 grey levels.
            total = np.sqrt(scenario.pixel_noise**2 + scenario.shot_noise**2 * grey / 255.0)
            self._gain = np.clip(np.rint(8.0 * total), 0, 255).astype(np.uint8)
            rms = _TILE_RMS
        self._active = rms > 0.0
        noise = (
            np.rint(random.normal(0.0, rms, (height + _SPARE, width + _SPARE))) if self._active else np.zeros((1, 1))
        )
        # Saturating unsigned additions are many times faster than any signed arithmetic on bytes.
        self._up = np.clip(noise, 0, 255).astype(np.uint8)
        self._down = np.clip(-noise, 0, 255).astype(np.uint8)

    def expose(self, picture: Image, random: np.random.Generator) -> Image:
        """Return the sensor's picture; noise is added to the given one in place."""
        if self._light is not None:
            picture = np.asarray(cv2.LUT(picture, self._light), dtype=np.uint8)
        if not self._active:
            return picture
        row, column = (int(n) for n in random.integers(0, _SPARE, 2))
        part = slice(row, row + self._size[0]), slice(column, column + self._size[1])
        sides = [self._up[part], self._down[part]]
        if self._gain is not None:
            gain = cv2.LUT(picture, self._gain)
            sides = [cv2.multiply(side, gain, scale=1.0 / (8.0 * _TILE_RMS)).astype(np.uint8) for side in sides]
        return np.asarray(cv2.subtract(cv2.add(picture, sides[0], picture), sides[1], picture), dtype=np.uint8)

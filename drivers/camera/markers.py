"""Identifies a marker by the bar of eight cells beside the board; an unsure reading counts as unknown."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from drivers.camera.detect import Find, homography, sample
from groundstation.arrays import Array
from groundstation.geometry import board as marker
from groundstation.geometry.lens import CameraIntrinsics

# The inner part of each cell, 3 x 3 samples, in squares.
_OFFSETS = np.array([[x, y] for x in (-0.16, 0.0, 0.16) for y in (-0.1, 0.0, 0.1)])
_SAMPLES = (marker.cell_centres()[:, None] + _OFFSETS).reshape(-1, 2)
# Blur of lens, pixel and sampling together; the sharper figure of measured pictures, so that contrast is not overrated.
_BLUR_PX = 0.9
_GRID = marker.corner_grid()


@dataclass(frozen=True, slots=True)
class BarReading:
    """A reading of the bar: the likeliest code (0..15), and by how many cells the next one fits worse (0..4)."""

    code: int
    margin: float

    def is_sure(self, least_margin: float) -> bool:
        """Return whether it is reliable as an identity; blank and solid bars leave no margin."""
        return self.margin > least_margin


def read_bar(
    picture: NDArray[np.uint8],
    find: Find,
    intrinsics: CameraIntrinsics,
    mirrored: bool = False,
    rays: Array | None = None,
) -> BarReading | None:
    """Return the reading of a board's bar, or None when the bar is not fully in the picture.

    rays: of the board's corners, normalised (n, 2), if the caller has them. mirrored: read the place where a mirrored
    print has its bar; the squares alone look the same both ways.
    """
    if rays is None:
        rays = intrinsics.normalised_from_pixels(find.corners)
    pixels = _bar_pixels(rays, intrinsics, _SAMPLES * (-1.0, 1.0) if mirrored else _SAMPLES)
    if pixels is None or not intrinsics.contains(pixels, 1.0).all():
        return None
    grey = sample(picture, pixels).reshape(marker.CELLS, -1).mean(axis=1)
    middles = pixels.reshape(marker.CELLS, 3, 3, 2)[:, 1, 1]
    pitch_px = float(np.hypot(*(middles[-1] - middles[0]))) / (marker.CELLS - 1)
    across = pixels.reshape(marker.CELLS, 3, 3, 2)[:, 2, 1] - pixels.reshape(marker.CELLS, 3, 3, 2)[:, 0, 1]
    width_px = float(np.hypot(*across.mean(axis=0))) * marker.BAR_WIDTH / (_OFFSETS[-1, 0] - _OFFSETS[0, 0])
    return decode((find.white - grey) / (find.white - find.black), pitch_px, width_px)


def decode(darkness: Array, pitch_px: float, width_px: float) -> BarReading:
    """Return the code word that best explains the darkness of eight cells, from 0 (white) to 1 (black).

    pitch_px, width_px: size of a cell in the picture; small cells run into each other and into the paper.
    """
    words = _expected(round(4.0 * min(pitch_px, 20.0)), round(4.0 * min(width_px, 20.0)))
    misfit = np.abs(darkness - words).sum(axis=1)
    first, second = np.argsort(misfit)[:2]
    return BarReading(int(first), float(misfit[second] - misfit[first]))


@lru_cache(maxsize=1024)
def _expected(quarter_pitch: int, quarter_width: int) -> Array:
    """Return the expected darkness (16, 8) of each word's cells after camera blur, for sizes in quarter pixels."""
    pitch, width = max(1, quarter_pitch) / 4.0, max(1, quarter_width) / 4.0
    distance = np.abs(np.subtract.outer(np.arange(marker.CELLS), np.arange(marker.CELLS))) * pitch
    mixing = _step((distance + pitch / 2) / _BLUR_PX) - _step((distance - pitch / 2) / _BLUR_PX)
    across = 2.0 * float(_step(np.array([width / 2 / _BLUR_PX]))[0]) - 1.0
    return np.asarray(marker.CODE_WORDS @ mixing.T * across)


def _step(ratio: Array) -> Array:
    return np.array([0.5 + 0.5 * math.erf(value / math.sqrt(2.0)) for value in ratio.ravel()]).reshape(ratio.shape)


def _bar_pixels(rays: Array, intrinsics: CameraIntrinsics, samples: Array) -> Array | None:
    """Return the pixels of the cells' samples: a homography of undistorted corners, then the lens."""
    if not np.isfinite(rays).all():
        return None
    h = homography(_GRID, rays)
    lifted = samples @ h[:, :2].T + h[:, 2]
    pixels = intrinsics.pixels_from_normalised(lifted[:, :2] / lifted[:, 2:])
    return pixels if np.isfinite(pixels).all() else None

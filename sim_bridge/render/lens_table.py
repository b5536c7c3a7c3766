"""The ray of every pixel, computed once per camera, so that drawing never inverts the lens again."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.geometry.lens import CameraIntrinsics

Float32 = NDArray[np.float32]

PAD = 2
COARSE = 8
# Pixels that no ray of the lens model reaches look far sideways, off every texture.
NOWHERE = 1e3


class LensTable:
    """Undistorted normalised coordinates of all pixels, and of a grid of every eighth one for smooth surfaces."""

    def __init__(self, intrinsics: CameraIntrinsics) -> None:
        self.width, self.height = intrinsics.width_px, intrinsics.height_px
        columns = np.arange(-PAD, self.width + PAD, dtype=np.float64)
        rows = np.arange(-PAD, self.height + PAD, dtype=np.float64)
        self._x, self._y = _rays(intrinsics, columns, rows)
        # Placed so that enlarging by 8 puts the samples exactly onto pixels; one extra sample on each side.
        coarse_columns = (np.arange(-1, -(-self.width // COARSE) + 1) + 0.5) * COARSE - 0.5
        coarse_rows = (np.arange(-1, -(-self.height // COARSE) + 1) + 0.5) * COARSE - 0.5
        self.coarse_x, self.coarse_y = _rays(intrinsics, coarse_columns, coarse_rows)
        # How far down the picture each coarse row is, 0 at the first row and 1 at the last (n, 1).
        self.coarse_share = (coarse_rows / (self.height - 1)).astype(np.float32)[:, None]

    def window(self, left: int, top: int, right: int, bottom: int) -> tuple[Float32, Float32]:
        """Return x and y for pixels left..right-1, top..bottom-1, widened by PAD pixels on each side."""
        part = slice(top, bottom + 2 * PAD), slice(left, right + 2 * PAD)
        return self._x[part], self._y[part]

    def enlarge(self, coarse: Float32) -> Float32:
        """Return a quantity sampled at the coarse rays for every pixel, by linear interpolation."""
        rows, columns = coarse.shape
        full = cv2.resize(coarse, (columns * COARSE, rows * COARSE), interpolation=cv2.INTER_LINEAR)
        return np.asarray(full[COARSE : COARSE + self.height, COARSE : COARSE + self.width], dtype=np.float32)


def _rays(
    intrinsics: CameraIntrinsics, columns: NDArray[np.floating[Any]], rows: NDArray[np.floating[Any]]
) -> tuple[Float32, ...]:
    grid = np.stack(np.meshgrid(columns, rows), axis=-1)
    normalised = np.nan_to_num(intrinsics.normalised_from_pixels(grid), nan=NOWHERE).astype(np.float32)
    return np.ascontiguousarray(normalised[..., 0]), np.ascontiguousarray(normalised[..., 1])

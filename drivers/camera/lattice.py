"""Any checkerboard in a whole picture, for calibration: the lattice of its inner corners, refined."""

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.detect import refined

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH
# Beyond this a picture is halved for finding; corners are refined in the full one all the same.
_MOST_PIXELS = 1_300_000


def find_lattice(picture: Picture, columns: int, rows: int) -> Array | None:
    """Return the inner corners (rows * columns, 2) [px], row by row, or None when the board is not all in the picture.

    Which corner comes first is up to how the board is held; with one odd and one even number of squares it is unique.
    """
    factor = 2 if picture.size > _MOST_PIXELS else 1
    small = picture if factor == 1 else cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    for flags in (_FLAGS, _FLAGS | cv2.CALIB_CB_NORMALIZE_IMAGE):
        found, raw = cv2.findChessboardCorners(small, (columns, rows), flags=flags)
        if found and raw is not None:
            coarse = (np.asarray(raw, dtype=np.float64).reshape(-1, 2) + 0.5) * factor - 0.5
            return refined(picture, coarse, columns)
    return None

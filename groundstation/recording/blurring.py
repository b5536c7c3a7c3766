"""Blurs pictures so that no person can be recognised: an eighth of the resolution, enlarged again."""

import cv2
import numpy as np

from groundstation.bus.jpeg import stated_size

_QUALITY = 60
_LEAST_PX = 8
# As exposed, not as EXIF data ask to turn it: markers have their places there.
_AN_EIGHTH = cv2.IMREAD_REDUCED_COLOR_8 | cv2.IMREAD_IGNORE_ORIENTATION
# Of an eighth of the size: no camera takes 64 million pixels, and more would exhaust the recorder's memory.
_MOST_PX = 1 << 20


def blurred(jpeg: bytes) -> bytes | None:
    """Return a JPEG of the same size with an eighth of the detail.

    None for data that is no picture, or has no plausible size.
    """
    try:
        coarse = cv2.imdecode(np.frombuffer(jpeg, np.uint8), _AN_EIGHTH) if jpeg else None
    except cv2.error:  # one that claims to be huge
        return None
    if coarse is None or min(coarse.shape[:2]) < _LEAST_PX or coarse.shape[0] * coarse.shape[1] > _MOST_PX:
        return None
    soft = cv2.GaussianBlur(coarse, (3, 3), 0)
    large = cv2.resize(soft, None, fx=8, fy=8, interpolation=cv2.INTER_LINEAR)
    width, height = stated_size(jpeg) or (None, None)  # an eighth is rounded up
    done, data = cv2.imencode(".jpg", large[:height, :width], [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return data.tobytes() if done else None

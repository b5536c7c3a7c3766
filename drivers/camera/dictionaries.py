"""The bits of tags, which OpenCV holds."""

import cv2

from groundstation.geometry.tag import SquareTag


def dictionary_of(name: str) -> cv2.aruco.Dictionary:
    """Return a predefined dictionary by its name in OpenCV."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def black_cells(tag: SquareTag) -> list[list[bool]]:
    """Return which modules of a tag are black, by rows from the top, the border of one module included."""
    picture = dictionary_of(tag.dictionary).generateImageMarker(tag.id, tag.modules, borderBits=1)
    return [[bool(cell == 0) for cell in row] for row in picture]

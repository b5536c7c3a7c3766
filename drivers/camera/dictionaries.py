"""The bits of tags and their detector, from OpenCV or another package."""

import cv2
import numpy as np

from groundstation import plug_ins
from groundstation.arrays import Array, Image
from groundstation.geometry.tag import DICTIONARIES, Finder, SquareTag, TagFamily


def dictionary_of(name: str) -> cv2.aruco.Dictionary:
    """Return a predefined dictionary by its name in OpenCV."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


class OpenCvTags:
    """A predefined dictionary of OpenCV; a `TagFamily`."""

    # Measured: the corners of tags scatter ten times as much as those of checkerboards, and four of them leave only two
    # degrees of freedom to notice it.
    corner_std_px = 0.6

    def __init__(self, name: str) -> None:
        self.count, self.bits = DICTIONARIES[name]
        self._dictionary = dictionary_of(name)

    def finder(self) -> Finder:
        """Return a finder of its tags in grey pictures."""
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        detector = cv2.aruco.ArucoDetector(self._dictionary, parameters)

        def find(picture: Image) -> list[tuple[int, Array]]:
            corners, ids, _ = detector.detectMarkers(np.ascontiguousarray(picture))
            found = zip(corners, np.ravel(ids), strict=True) if len(corners) else ()
            return [(int(number), np.asarray(four, np.float64).reshape(4, 2)) for four, number in found]

        return find

    def black_cells(self, number: int) -> list[list[bool]]:
        """Return which modules of a tag are black, by rows from the top, the border of one module included."""
        picture = self._dictionary.generateImageMarker(number, self.bits + 2, borderBits=1)
        return [[bool(cell == 0) for cell in row] for row in picture]


def family_of(dictionary: str) -> TagFamily:
    """Return the family of the tags of a dictionary; raises PlugInError for an unusable plug-in."""
    family: TagFamily = OpenCvTags(dictionary) if dictionary in DICTIONARIES else plug_ins.tag_family(dictionary)
    return family


def black_cells(tag: SquareTag) -> list[list[bool]]:
    """Return which modules of a tag are black, by rows from the top, the border of one module included."""
    return family_of(tag.dictionary).black_cells(tag.id)

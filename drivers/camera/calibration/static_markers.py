"""Markers that lie still before a camera: found, read and averaged over many pictures."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivers.camera.markers import read_bar
from drivers.camera.search import search
from groundstation.arrays import Array, Image
from groundstation.geometry import board as marker
from groundstation.geometry.lens import CameraIntrinsics

_MOST_BOARDS = 16
_SURE, _SURE_MIRRORED = 1.0, 2.0
# More than this between pictures, and the marker or the camera has moved [px].
_STILL_PX = 1.5


@dataclass(frozen=True, slots=True)
class MarkerReading:
    """A marker in one picture: its code (None: uncertain), margin of the reading, corners (12, 2) [px].

    mirrored: the code of one that reads in a mirror.
    """

    code: int | None
    margin: float
    corners: Array
    mirrored: int | None = None


@dataclass(frozen=True, slots=True)
class Steady:
    """A marker's corners (12, 2) [px] over several pictures, and one sigma of their mean."""

    corners: Array
    std_px: float
    pictures: int
    moved: bool


def markers_in(picture: Image, lens: CameraIntrinsics) -> list[MarkerReading]:
    """Return all markers of ours in a picture, the unreadable ones without a code."""
    seen = []
    for find in search(picture, [], _MOST_BOARDS):
        reading = read_bar(picture, find, lens)
        sure = reading is not None and reading.is_sure(_SURE)
        code = reading.code if reading is not None and sure else None
        mirrored = read_bar(picture, find, lens, mirrored=True) if code is None else None
        wrong = mirrored.code if mirrored is not None and mirrored.is_sure(_SURE_MIRRORED) else None
        seen.append(MarkerReading(code, reading.margin if reading is not None else 0.0, find.corners, wrong))
    return seen


class Gathering:
    """Collects the markers of single pictures.

    `doubled`: codes that were seen twice in one picture; `mirrored`: codes that read in a mirror.
    """

    def __init__(self, lens: CameraIntrinsics) -> None:
        self._lens = lens
        self._corners: defaultdict[int, list[Array]] = defaultdict(list)
        self.pictures = 0
        self.unread = 0
        self.doubled: set[int] = set()
        self.mirrored: set[int] = set()

    def take(self, picture: Image) -> list[MarkerReading]:
        """Take a picture; return the markers in it."""
        seen = markers_in(picture, self._lens)
        self.pictures += 1
        codes = [one.code for one in seen if one.code is not None]
        self.unread += len(seen) - len(codes)
        self.doubled |= {code for code in codes if codes.count(code) > 1}
        self.mirrored |= {one.mirrored for one in seen if one.mirrored is not None}
        for one in seen:
            if one.code is not None:
                self._corners[one.code].append(one.corners)
        return seen

    def steady(self) -> Mapping[int, Steady]:
        """Return corners of each marker, by code; their median, so that one bad picture does no harm."""
        found = {}
        for code, many in sorted(self._corners.items()):
            stack = np.array(many)
            middle = np.median(stack, axis=0)
            spread = float(np.sqrt(((stack - middle) ** 2).mean()))
            # A median's variance is pi/2 times a mean's.
            std = spread * float(np.sqrt(np.pi / 2 / len(many)))
            found[code] = Steady(middle, std, len(many), spread > _STILL_PX)
        return found


def flat_points(square_mm: float) -> Array:
    """Return a marker's corners (12, 3) [m; marker frame]."""
    return marker.Checkerboard(0, square_mm).corners()

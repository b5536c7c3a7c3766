"""Square tags (ArUco, AprilTag, plug-ins) as second kind of marker: sizes and corners; bits belong to their family.

Marker frame: origin at the centre, z out of the face, x to the right and y up as printed; forward is x.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Protocol

import numpy as np

from groundstation import plug_ins
from groundstation.arrays import Array, Image

Finder = Callable[[Image], Iterable[tuple[int, Array]]]

# Name of the dictionary -> how many tags it holds, and bits along the side of one without its black border.
DICTIONARIES: dict[str, tuple[int, int]] = {
    **{f"DICT_{n}X{n}_{count}": (count, n) for n in (4, 5, 6, 7) for count in (50, 100, 250, 1000)},
    "DICT_ARUCO_ORIGINAL": (1024, 5),
    "DICT_ARUCO_MIP_36H12": (250, 6),
    "DICT_APRILTAG_16H5": (30, 4),
    "DICT_APRILTAG_25H9": (35, 5),
    "DICT_APRILTAG_36H10": (2320, 6),
    "DICT_APRILTAG_36H11": (587, 6),
}


class TagFamily(Protocol):
    """A dictionary of square tags: OpenCV's, or that of another package (entry point `skein.markers`).

    count: ids are below that; bits: along the side of a tag without its black border of one module; corner_std_px:
    standard deviation of its finder's corners [px].
    """

    count: int
    bits: int
    corner_std_px: float

    def finder(self) -> Finder:
        """Return a function that finds tags in a grey picture (h, w): ids and corners (4, 2) [px].

        In the order of `SquareTag.corners`; the centre of the first pixel is (0, 0).
        """

    def black_cells(self, number: int) -> list[list[bool]]:
        """Return which modules of a tag are black, by rows from the top, the border of one module included."""


# White paper around the black border, in modules (the side of a bit).
QUIET_MODULES = 1.0


@dataclass(frozen=True, slots=True)
class SquareTag:
    """One printed tag: dictionary, id in it, and the side of its black square [mm]. Raises ValueError if unknown."""

    dictionary: str
    id: int
    size_mm: float

    def __post_init__(self) -> None:
        fault = tag_fault(self.dictionary, self.id)
        if fault:
            raise ValueError(fault)
        if not self.size_mm > 0.0:
            raise ValueError(f"size_mm must be positive (got {self.size_mm})")

    @property
    def modules(self) -> int:
        """Return the side of the black square in modules: the bits and a border of one on each side."""
        bits = DICTIONARIES[self.dictionary][1] if self.family is None else self.family.bits
        return bits + 2

    @property
    def family(self) -> TagFamily | None:
        """Return the plug-in of its dictionary, None for those of OpenCV."""
        if self.dictionary in DICTIONARIES:
            return None
        family: TagFamily = plug_ins.tag_family(self.dictionary)
        return family

    @property
    def module_m(self) -> float:
        """Return the side of a module [m]."""
        return self.size_mm / 1000.0 / self.modules

    def corners(self) -> Array:
        """Return the corners of the black square (4, 3) [m; marker frame]: as printed, clockwise from the top left."""
        half = self.size_mm / 2000.0
        return np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])

    def outline(self) -> Array:
        """Return the corners of the card with its quiet zone (4, 3) [m; marker frame], counter-clockwise."""
        return self.corners()[::-1] * (1.0 + 2.0 * QUIET_MODULES / self.modules)

    def radius_m(self) -> float:
        """Return the distance from the origin to the farthest corner of the card [m]."""
        return float(np.linalg.norm(self.outline(), axis=1).max())


def tag_fault(dictionary: str, number: int) -> str:
    """Return the fault of a dictionary or of an id in it; "" if there is none."""
    if dictionary in DICTIONARIES:
        count = DICTIONARIES[dictionary][0]
    elif dictionary in (installed := plug_ins.names(plug_ins.MARKERS)):
        try:
            count = plug_ins.tag_family(dictionary).count
        except plug_ins.PlugInError as error:
            return f"dictionary {error}"
    else:
        known = (*sorted(DICTIONARIES), *installed)
        others = f"{_meant(dictionary, known)} (got {dictionary}){plug_ins.damage()}"
        return f"dictionary must be one of {', '.join(known)}{others}"
    return "" if 0 <= number < count else f"id must be in 0..{count - 1} of {dictionary} (got {number})"


def _meant(dictionary: str, known: Sequence[str]) -> str:
    """Return the likeliest dictionary for a name: OpenCV itself writes 36h11 in C++, and both forms in Python."""
    by_capitals = {name.upper(): name for name in known}
    near = get_close_matches(dictionary.upper(), by_capitals, 1, 0.8)
    return f"; did you mean {by_capitals[near[0]]}?" if near else ""

"""Square tags (ArUco, AprilTag) as second kind of marker: sizes and corners; their bits belong to OpenCV.

Marker frame: origin at the centre, z out of the face, x to the right and y up as printed; forward is x.
"""

from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array

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
        return DICTIONARIES[self.dictionary][1] + 2

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
    """Return what is wrong with a dictionary or an id in it; "" when nothing is."""
    if dictionary not in DICTIONARIES:
        return f"dictionary must be one of {', '.join(sorted(DICTIONARIES))} (got {dictionary})"
    count = DICTIONARIES[dictionary][0]
    return "" if 0 <= number < count else f"id must be in 0..{count - 1} of {dictionary} (got {number})"

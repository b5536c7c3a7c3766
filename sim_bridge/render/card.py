"""The print of a marker's card, checkerboard or tag, as a picture at any resolution."""

from typing import Protocol

import cv2
import numpy as np

from groundstation.arrays import Array, Image
from groundstation.geometry import board
from groundstation.geometry.tag import QUIET_MODULES, SquareTag
from sim_bridge.render.spec import BoardSpec


class Card(Protocol):
    """A flat print: unit_m is its square or module, extent x0 x1 y0 y1 in units about the marker's origin."""

    unit_m: float
    extent: tuple[float, float, float, float]

    def raster(self, texels_per_unit: float) -> tuple[Image, Array]:
        """Return the print as a grey picture, and texel_from_unit (3, 3); texel i covers [i - 0.5, i + 0.5]."""


class BoardCard:
    """A checkerboard with its bar."""

    def __init__(self, code: int, square_mm: float) -> None:
        self._code = board.Checkerboard(code, square_mm).code
        self.unit_m = square_mm / 1000.0
        self.extent = board.EXTENT

    def raster(self, texels_per_unit: float) -> tuple[Image, Array]:
        """Return the print as a grey picture, and texel_from_unit."""
        return board.raster(self._code, texels_per_unit)


class TagCard:
    """A square tag with its quiet zone; its bits are OpenCV's or a plug-in's."""

    def __init__(self, tag: SquareTag) -> None:
        if tag.family is not None:
            black = np.array(tag.family.black_cells(tag.id))
        else:
            dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, tag.dictionary))
            black = dictionary.generateImageMarker(tag.id, tag.modules, borderBits=1) == 0
        self._cells = np.pad(np.where(black, board.BLACK, board.WHITE), 1, constant_values=board.WHITE).astype(np.uint8)
        self.unit_m = tag.module_m
        half = tag.modules / 2 + QUIET_MODULES
        self.extent = (-half, half, -half, half)

    def raster(self, texels_per_unit: float) -> tuple[Image, Array]:
        """Return the print as a grey picture, and texel_from_unit; whole texels per module."""
        texels = max(1, round(texels_per_unit))
        picture = self._cells.repeat(texels, axis=0).repeat(texels, axis=1)
        offset = self.extent[1] * texels - 0.5
        return picture, np.array([[texels, 0.0, offset], [0.0, -texels, offset], [0.0, 0.0, 1.0]])


def card_of(spec: BoardSpec) -> Card:
    """Return the print of a board of the scene."""
    return BoardCard(spec.code, spec.square_mm) if spec.tag is None else TagCard(spec.tag)

"""Pictures of a source, and the interface that all kinds of sources share."""

from collections import Counter
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Image

# A lens is calibrated for its sensor's rows and columns, so rotations for display (EXIF) are ignored.
GREY_AS_EXPOSED = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
_JPEG_QUALITY = (cv2.IMWRITE_JPEG_QUALITY, 80)


class Picture(Protocol):
    """A picture that a source had to decode itself."""

    def grey(self) -> Image:
        """Return its brightness (h, w)."""

    def jpeg(self) -> bytes:
        """Return it for display, in colour if it has any."""


@dataclass(frozen=True, slots=True)
class Matrix:
    """A picture that is an OpenCV array, (h, w) or (h, w, 3) BGR."""

    pixels: NDArray[np.uint8]

    def grey(self) -> Image:
        """Return its brightness (h, w)."""
        if self.pixels.ndim == 2:
            return self.pixels
        return np.asarray(cv2.cvtColor(self.pixels, cv2.COLOR_BGR2GRAY), dtype=np.uint8)

    def jpeg(self) -> bytes:
        """Return it compressed for display."""
        return cv2.imencode(".jpg", self.pixels, _JPEG_QUALITY)[1].tobytes()


@dataclass(frozen=True, slots=True)
class Unit:
    """One compressed picture as received, with its arrival [ns, boot clock].

    settled_ns: arrival with the link's usual delay, if the stream carries times of its own; else the arrival. starts: a
    decoder can begin here; follows: nothing is missing since its predecessor; picture: if the reader has already
    decoded it; held_back: it may be old, of an unknown time, and is decoded for the pictures after it only.
    """

    data: bytes
    arrival_ns: int
    settled_ns: int
    starts: bool = True
    follows: bool = True
    picture: Picture | None = None
    held_back: bool = False


@dataclass(frozen=True, slots=True)
class Packet:
    """The newest picture of a source and its number in the stream; times as in `Unit`.

    data: the JPEG as received (empty: the source sends none); picture: present if the source decodes itself.
    """

    data: bytes
    arrival_ns: int
    settled_ns: int
    number: int
    picture: Picture | None = None


class FrameSource(Protocol):
    """Anything that delivers pictures, the newest first and only."""

    rejected: Counter[str]

    @property
    def connected(self) -> bool:
        """Return whether the source can deliver at the moment."""

    @property
    def detail(self) -> str:
        """Return the reason when it cannot."""

    @property
    def received(self) -> int:
        """Return how many pictures have arrived, taken or not."""

    def take_newest(self, timeout_s: float) -> Packet | None:
        """Return the newest picture not yet taken, waiting for one at most that long."""

    def take_video(self) -> list[Unit]:
        """Return the H.264 access units up to the picture taken last, as received; a JPEG source has none."""

    def close(self) -> None:
        """Stop reading; idempotent."""

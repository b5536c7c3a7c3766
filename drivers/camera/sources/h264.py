"""Decodes H.264 access units to pictures: from the newest key picture on, never across a gap."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import av
import numpy as np
from av.codec.context import Flags

from drivers.camera.sources.frames import Matrix, Picture, Unit
from drivers.camera.sources.picture_numbers import PictureNumbers
from groundstation.arrays import Image

# Larger than any known camera; ffmpeg refuses a stream that claims more before it allocates memory.
_MOST_PIXELS = 4096 * 2304
# Formats whose first plane is the brightness.
_PLANAR = ("gray", "yuv4", "yuvj4", "nv12", "nv21")


@dataclass(frozen=True, slots=True)
class VideoPicture:
    """A picture of a video stream."""

    frame: av.VideoFrame

    def grey(self) -> Image:
        """Return its brightness (h, w), of 8 bits as the stream carries it."""
        form = self.frame.format
        # Samples of more bits than 8 take two bytes each.
        if not form.name.startswith(_PLANAR) or form.components[0].bits != 8:
            return np.asarray(self.frame.to_ndarray(format="gray"), dtype=np.uint8)
        plane = self.frame.planes[0]
        rows = np.frombuffer(memoryview(plane), np.uint8).reshape(plane.height, plane.line_size)
        return np.ascontiguousarray(rows[:, : plane.width])

    def jpeg(self) -> bytes:
        """Return it in colour, compressed for display."""
        return Matrix(np.asarray(self.frame.to_ndarray(format="bgr24"), dtype=np.uint8)).jpeg()


class H264Decoder:
    """Decodes one stream (Annex B, parameter sets in the key pictures); `rejected` is the source's count."""

    needs_all = True

    def __init__(self, rejected: Counter[str]) -> None:
        self.rejected = rejected
        self._codec = _codec()
        self._waiting = True
        self._numbers = PictureNumbers()

    def newest(self, units: Sequence[Unit]) -> tuple[Unit, Picture] | None:
        """Return the newest picture that can be decoded of these units, or None."""
        found: tuple[Unit, Picture] | None = None
        for unit in units[_newest_start(units) :]:
            if reason := self._refusal(unit):
                self.rejected[reason] += 1
                continue
            frame = self._decode(unit)
            if frame is not None:
                found = unit, VideoPicture(frame)
        return found

    def _refusal(self, unit: Unit) -> str:
        """Return why a unit is not decoded, or ""."""
        if unit.starts:
            self._waiting = False
            self._numbers.begin()
        elif not unit.follows:
            self._waiting = True
        if self._waiting:
            return "before_key_picture"
        # In the place of a lost picture ffmpeg takes the one before it, without an error.
        self._waiting = not self._numbers.follows(unit.data)
        return "after_lost_picture" if self._waiting else ""

    def _decode(self, unit: Unit) -> av.VideoFrame | None:
        try:
            frames = self._codec.decode(av.Packet(unit.data))
            if not frames:
                return None
            if not frames[-1].is_corrupt:
                return frames[-1]
        except (av.FFmpegError, ValueError):
            pass
        # Later pictures refer to a missing one: begin again at the next key picture.
        self.rejected["h264"] += 1
        self._codec, self._waiting = _codec(), True
        return None


def _newest_start(units: Sequence[Unit]) -> int:
    return max((index for index, unit in enumerate(units) if unit.starts), default=0)


def _codec() -> av.VideoCodecContext:
    codec = av.CodecContext.create("h264", "r")
    assert isinstance(codec, av.VideoCodecContext)
    codec.thread_count = 1
    codec.flags |= Flags.low_delay
    codec.options = {"max_pixels": str(_MOST_PIXELS)}
    return codec

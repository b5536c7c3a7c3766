"""Uncompressed pictures, and pictures that a reader has decoded already: only the newest counts."""

from collections.abc import Sequence

import av

from drivers.camera.sources.frames import Picture, Unit
from drivers.camera.sources.h264 import VideoPicture


class RawDecoder:
    """Reads uncompressed pictures of a known pixel format and size."""

    needs_all = False

    def __init__(self, pixel_format: str, width: int, height: int) -> None:
        codec = av.CodecContext.create("rawvideo", "r")
        assert isinstance(codec, av.VideoCodecContext)
        codec.pix_fmt, codec.width, codec.height = pixel_format, width, height
        self._codec = codec

    def newest(self, units: Sequence[Unit]) -> tuple[Unit, Picture] | None:
        """Return the last of them, or None when it is not whole."""
        try:
            frames = self._codec.decode(av.Packet(units[-1].data))
        except (av.FFmpegError, ValueError):
            return None
        return (units[-1], VideoPicture(frames[-1])) if frames else None


class Decoded:
    """For readers that decode themselves."""

    needs_all = False

    def newest(self, units: Sequence[Unit]) -> tuple[Unit, Picture] | None:
        """Return the last of them."""
        picture = units[-1].picture
        return None if picture is None else (units[-1], picture)

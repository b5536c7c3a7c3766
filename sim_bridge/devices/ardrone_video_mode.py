"""The settings of an emulated AR.Drone's video; apart from the encoder, which the simulator's loop need not load."""

from collections.abc import Callable
from typing import NamedTuple

# WIRE (docs/reference/ardrone.md 5.4): values of video:video_codec whose live stream is 720p; the others are 360p.
_CODECS_720P = frozenset({0x83})
_BOTTOM = 1
_MANUAL_BITRATE = 2


class VideoMode(NamedTuple):
    """The video settings of the drone's configuration; bit rates [kbit/s] are of codec_fps pictures a second."""

    codec: int = 0x81
    channel: int = 0
    codec_fps: int = 30
    max_bitrate: int = 1000
    bitrate: int = 1000
    bitrate_mode: int = 0

    @classmethod
    def configured(cls, key: Callable[[str], int]) -> "VideoMode":
        """Return the mode that a drone's configuration asks for; key: whole numbers by name."""
        names = ("video_codec", "video_channel", "codec_fps", "max_bitrate", "bitrate", "bitrate_ctrl_mode")
        return cls(*(key(f"video:{name}") for name in names))

    @property
    def size(self) -> tuple[int, int]:
        """Return width and height of the pictures [px]."""
        return (1280, 720) if self.codec in _CODECS_720P else (640, 360)

    @property
    def bottom(self) -> bool:
        """Return whether the camera below is shown."""
        return self.channel == _BOTTOM

    @property
    def stream(self) -> int:
        """Return the stream id of the PaVE frames."""
        return 2 if self.codec in _CODECS_720P else 1

    @property
    def bits_per_picture(self) -> float:
        """Return the mean size of a picture; it does not grow when fewer pictures a second are sent than configured."""
        kbits = self.bitrate if self.bitrate_mode == _MANUAL_BITRATE else self.max_bitrate
        return min(max(kbits, 250), 4000) * 1000 / min(max(self.codec_fps, 1), 30)

"""Encodes grey pictures as H.264 the way drones do: baseline, without delay."""

from fractions import Fraction

import av
import numpy as np
from av.video.frame import PictureType
from numpy.typing import NDArray

# WIRE (docs/reference/ardrone.md 6): an IDR with its parameter sets every 15 pictures.
_IDR_PERIOD = 15
_SHORT_CODE = b"\x00\x00\x01"
_SEI, _PARAMETERS = 6, (7, 8)
# WIRE (docs/reference/ardrone.md 6): pictures as the sensor sees them are of limited range: 16 to 235.
_BLACK, _RANGE = np.float32(16.0), np.float32(219.0 / 255.0)
_NO_COLOUR = 128


class GreyStream:
    """One stream (Annex B) of pictures of one size (width, height) [px]; bit_rate [bit/s]."""

    def __init__(self, size: tuple[int, int], fps: float, bit_rate: float) -> None:
        self._index = 0
        self._codec = _codec(size, fps, bit_rate)
        # One frame for all pictures: the encoder copies its input.
        self._frame = av.VideoFrame(*size, "yuv420p")
        luma, *colours = (np.asarray(memoryview(plane)) for plane in self._frame.planes)
        self._luma = luma.reshape(size[1], -1)[:, : size[0]]
        for colour in colours:
            colour[...] = _NO_COLOUR

    def encode(self, picture: NDArray[np.uint8], want_idr: bool) -> tuple[bytes, bool]:
        """Return a picture (h, w) as an access unit, and whether a decoder can begin with it."""
        self._luma[...] = picture * _RANGE + (_BLACK + np.float32(0.5))
        frame = self._frame
        frame.pts = self._index
        frame.pict_type = PictureType.I if want_idr else PictureType.NONE
        self._index += 1
        (packet,) = self._codec.encode(frame)  # no look-ahead: each picture comes out at once
        return _without_remarks(bytes(packet)), packet.is_keyframe


def _without_remarks(payload: bytes) -> bytes:
    """Return the payload without an SEI unit behind its parameter sets: the encoder signs its first picture, which no
    drone does."""
    place = payload.find(_SHORT_CODE)
    while place >= 0 and payload[place + len(_SHORT_CODE)] & 0x1F in _PARAMETERS:
        place = payload.find(_SHORT_CODE, place + len(_SHORT_CODE))
    if place < 0 or payload[place + len(_SHORT_CODE)] & 0x1F != _SEI:
        return payload
    end = payload.find(_SHORT_CODE, place + len(_SHORT_CODE))
    start, end = (at - (payload[at - 1] == 0) for at in (place, end))
    return payload[:start] + payload[end:]


def _codec(size: tuple[int, int], fps: float, bit_rate: float) -> av.VideoCodecContext:
    codec = av.CodecContext.create("libx264", "w")
    assert isinstance(codec, av.VideoCodecContext)
    codec.width, codec.height = size
    codec.pix_fmt = "yuv420p"
    codec.framerate = Fraction(fps).limit_denominator(1000)
    codec.time_base = 1 / codec.framerate
    codec.thread_count = 1
    codec.bit_rate = round(bit_rate)
    kbits = round(codec.bit_rate / 1000)
    parameters = f"keyint={_IDR_PERIOD}:min-keyint=1:scenecut=0:vbv-maxrate={kbits}:vbv-bufsize={max(1, kbits // 2)}"
    # Real drones encode in hardware: better than x264's fastest preset at the same rate, so it is not the fastest.
    # subme=0, motion by whole pixels, costs 0.2 dB of 0.9 and saves a fifth of the time.
    codec.options = {
        "preset": "superfast",
        "tune": "zerolatency",
        "profile": "baseline",
        "forced-idr": "1",
        "x264-params": f"{parameters}:annexb=1:repeat-headers=1:subme=0",
    }
    return codec

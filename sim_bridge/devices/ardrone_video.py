"""The video port of an emulated AR.Drone 2: H.264 in PaVE frames over TCP 5555.

WIRE (docs/reference/ardrone.md 6): the stream begins when a client connects, whatever the client sends; an IDR with
its parameter sets every 15 pictures; for a late reader, frames are dropped up to the next IDR.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.ardrone.wire.pave import FrameType, PaveFrame, encode_frame
from sim_bridge.devices.ardrone_video_mode import VideoMode
from sim_bridge.devices.h264 import GreyStream
from sim_bridge.devices.stream_server import Client, StreamServer

PORT = 5555
_AVC = 4
_START_CODE = b"\x00\x00\x00\x01"
_SHORT_CODE = b"\x00\x00\x01"


@dataclass(frozen=True, slots=True)
class EncodedPicture:
    """A PaVE frame and whether a decoder can begin with it."""

    data: bytes
    is_idr: bool


class VideoEncoder:
    """Encodes grey pictures of one mode as PaVE frames; `number` and `position` continue in the next encoder."""

    def __init__(self, mode: VideoMode, fps: float, header_bytes: int, number: int = 0, position: int = 0) -> None:
        self.mode, self.number, self.position = mode, number, position
        self._header_bytes = header_bytes
        self._stream = GreyStream(mode.size, fps, mode.bits_per_picture * fps)

    def encode(self, picture: NDArray[np.uint8], timestamp_ms: int, want_idr: bool) -> EncodedPicture:
        """Return a picture (h, w) of the mode's size as the next PaVE frame."""
        payload, is_key = self._stream.encode(picture, want_idr)
        kind = FrameType.IDR if is_key else FrameType.PREDICTED
        sizes = parameter_sizes(payload) if is_key else (0, 0)
        width, height = self.mode.size
        self.number += 1
        pave = PaveFrame(
            _AVC,
            width,
            height,
            self.number,
            timestamp_ms,
            kind,
            payload,
            stream=self.mode.stream,
            parameter_sizes=sizes,
        )
        data = encode_frame(pave, self.position, self._header_bytes)
        self.position += len(data)
        return EncodedPicture(data, is_key)


def parameter_sizes(payload: bytes) -> tuple[int, int]:
    """Return the bytes of SPS and PPS, start codes included, at the beginning of a key picture."""
    second = payload.find(_START_CODE, 4)
    third = payload.find(_SHORT_CODE, second + 4)
    if second < 0 or third < 0:
        return 0, 0
    third -= payload[third - 1] == 0
    return second, third - second


class ArDroneVideoServer(StreamServer):
    """Serves PaVE frames; a client that comes or falls behind begins at the next IDR."""

    def __init__(self, address: str, port: int = PORT) -> None:
        self._newcomers = False
        super().__init__(address, port)

    def send_at(self, release_ns: int, picture: EncodedPicture) -> None:
        """Hand a frame to all clients at a monotonic time [ns]."""
        self._hand_over(release_ns, picture.data, stands_alone=picture.is_idr)

    def take_newcomers(self) -> bool:
        """Return whether a client has connected since the last call: the next picture should be an IDR."""
        came, self._newcomers = self._newcomers, False
        return came

    def _greet(self, client: Client) -> None:
        client.streaming = True
        self._newcomers = True

    def _hear(self, client: Client, data: bytes) -> bool:
        return True

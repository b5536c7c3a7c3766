"""Sources that ffmpeg opens: network cameras by RTSP, and the devices of this machine.

The reader passes on packets as they come, H.264 and JPEG as received; nothing is decoded here.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import av

from drivers.camera.sources.frames import Unit
from drivers.camera.sources.h264 import H264Decoder
from drivers.camera.sources.jitter_filter import SenderClock
from drivers.camera.sources.nal_units import has_parameters
from drivers.camera.sources.raw import RawDecoder
from drivers.camera.sources.reader_thread import Drain, PictureDecoder
from groundstation.bus import clock
from groundstation.errors import DriverError
from groundstation.time_units import NS_PER_S

_OPEN_LIMIT_S = 5.0
_READ_LIMIT_S = 2.0
# How often a device is asked for a picture: a part of the time between two.
_LOOK_S = 0.002
Choice = Mapping[str, str]


class ContainerReader:
    """Reads the first video stream of an address.

    `choices`: sets of ffmpeg options, of which the first that works is used.
    """

    def __init__(self, address: str, name: str, choices: tuple[Choice, ...], form: str | None = None) -> None:
        self.name = name
        self.rejected: Counter[str] = Counter()
        self.decoder: PictureDecoder | None = None
        self._address, self._choices, self._form = address, choices, form

    def interrupt(self) -> None:
        """Do nothing: no read waits for more than 2 s."""

    def read(self, drain: Drain) -> None:
        """Hand over packets until the drain closes."""
        with self._open() as container:
            stream = next(iter(container.streams.video), None)
            if stream is None:
                raise DriverError("there is no video in it")
            prepared = self._prepare(stream)
            drain.opened()
            settled = SenderClock()
            for packet in _packets(container, stream, drain):
                drain.keep(_units(packet, prepared, settled))

    def _open(self) -> "av.container.InputContainer":
        trouble = ""
        for choice in self._choices:
            try:
                return av.open(
                    self._address, format=self._form, options=dict(choice), timeout=(_OPEN_LIMIT_S, _READ_LIMIT_S)
                )
            except (av.FFmpegError, ValueError) as error:
                trouble = getattr(error, "strerror", None) or str(error)
        raise DriverError(trouble)

    def _prepare(self, stream: av.VideoStream) -> Callable[[bytes, bool], bytes]:
        codec = stream.codec_context
        match codec.name:
            case "h264":
                self.decoder = H264Decoder(self.rejected)
                parameters = codec.extradata or b""
                return lambda data, is_key: parameters + data if is_key and not has_parameters(data) else data
            case "mjpeg":
                self.decoder = None
            case "rawvideo" if codec.pix_fmt is not None:
                self.decoder = RawDecoder(codec.pix_fmt, codec.width, codec.height)
            case other:
                raise DriverError(f"its video is {other}: only H.264, MJPEG and raw pictures are read")
        return lambda data, _: data


def _packets(
    container: "av.container.InputContainer", stream: av.VideoStream, drain: Drain
) -> Iterator["av.Packet[Any]"]:
    """Yield the packets of a stream until the drain closes; raises DriverError after 2 s without any, and at the end.

    Those of the other streams are read and dropped: the sound of a camera whose video hangs goes on.
    """
    came_s = time.monotonic()
    while True:
        try:
            for packet in container.demux():
                if packet.stream_index == stream.index:
                    came_s = time.monotonic()
                    yield packet
                _require_video_since(came_s)
                if drain.closing:
                    return
            raise DriverError("the camera closed the stream")
        except av.BlockingIOError:  # a device that has no picture yet
            _require_video_since(came_s)
            if drain.wait(_LOOK_S):
                return
        except av.FFmpegError as error:
            raise DriverError(error.strerror or str(error)) from None


def _require_video_since(came_s: float) -> None:
    if time.monotonic() - came_s > _READ_LIMIT_S:
        raise DriverError(f"no picture for {_READ_LIMIT_S:g} s")


def _units(packet: "av.Packet[Any]", prepared: Callable[[bytes, bool], bytes], settled: SenderClock) -> list[Unit]:
    if packet.size == 0:
        return []
    arrival_ns = clock.now_ns()
    settled_ns, held_back = arrival_ns, False
    # With B-frames, times of display (pts) go back and forth: the filter needs those in the order of sending (dts).
    if packet.dts is not None and packet.time_base is not None:
        (settled_ns,) = settled.settle([round(packet.dts * packet.time_base * NS_PER_S)], arrival_ns)
        held_back = settled.opening
    data = prepared(bytes(packet), packet.is_keyframe)
    follows = not packet.is_corrupt
    return [Unit(data, arrival_ns, settled_ns, packet.is_keyframe, follows, held_back=held_back)]


def rtsp(url: str, name: str) -> ContainerReader:
    """Return the reader of a network camera: over TCP, because losses tear pictures, and without ffmpeg's buffers."""
    options = {
        "rtsp_transport": "tcp",
        "fflags": "nobuffer",
        "flags": "low_delay",
        "max_delay": "0",
        "reorder_queue_size": "0",
        "probesize": "500000",
        "analyzeduration": "0",
        "fpsprobesize": "0",  # else it takes some 20 pictures more, to learn their rate
    }
    return ContainerReader(url, name, (options,))


def device(path: str, size: tuple[int, int] | None) -> ContainerReader:
    """Return the reader of a V4L2 device, asked for pictures of the calibrated size; JPEGs before raw pictures."""
    wanted = {} if size is None else {"video_size": f"{size[0]}x{size[1]}"}
    # ffmpeg waits without limit, and uninterrupted, for the picture of a device that hangs.
    asked = {"fflags": "4"}
    choices: tuple[Choice, ...] = ({"input_format": "mjpeg", **wanted, **asked}, {**wanted, **asked}, asked)
    return ContainerReader(path, path, choices, form="v4l2")

"""The AR.Drone 2's own video: PaVE frames with H.264 over TCP 5555 (`ardrone://ADDRESS`).

It sends nothing: the flight driver chooses codec and channel, because two senders of AT commands would conflict over
sequence numbers.
"""

from collections import Counter

from drivers.ardrone.wire.pave import FrameReader, FrameType, PaveFrame
from drivers.camera.sources.frames import Unit
from drivers.camera.sources.h264 import H264Decoder
from drivers.camera.sources.jitter_filter import SenderClock
from drivers.camera.sources.reader_thread import Drain, PictureDecoder
from drivers.camera.sources.tcp import Line
from groundstation.bus import clock
from groundstation.errors import DriverError
from groundstation.time_units import NS_PER_MS

_READ_BYTES = 1 << 18
# WIRE (docs/reference/ardrone.md 6): codecs of PaVE frames.
_CODECS = {1: "VLIB (AR.Drone 1)", 2: "P264 (AR.Drone 1)", 3: "MPEG-4.2"}
_AVC = 4


class Assembly:
    """Turns PaVE frames into access units: joins slices, detects gaps, and gives each its settled arrival. Pure."""

    def __init__(self) -> None:
        self._clock = SenderClock()
        self._slices: list[PaveFrame] = []
        self._last: PaveFrame | None = None

    def units(self, frames: list[PaveFrame], arrival_ns: int) -> list[Unit]:
        """Return the access units that these frames complete.

        Raises DriverError for a codec that cannot be decoded, naming it.
        """
        whole = [slices for frame in frames if frame.payload and (slices := self._joined(frame))]
        if not whole:
            return []
        sent_ns = [slices[0].timestamp_ms * NS_PER_MS for slices in whole]
        settled_ns = self._clock.settle(sent_ns, arrival_ns)
        return [self._unit(slices, arrival_ns, when) for slices, when in zip(whole, settled_ns, strict=True)]

    def _joined(self, frame: PaveFrame) -> list[PaveFrame]:
        """Return the slices of the picture that this frame completes, or nothing."""
        if frame.codec != _AVC:
            named = _CODECS.get(frame.codec, f"codec {frame.codec}")
            raise DriverError(f"its video is {named}: only H.264 is read; set the drone's video to h264_360p")
        if self._slices and self._slices[-1].number != frame.number:
            self._slices = []
        self._slices.append(frame)
        if frame.slice_index + 1 < frame.slices:
            return []
        done, self._slices = self._slices, []
        return done

    def _unit(self, slices: list[PaveFrame], arrival_ns: int, settled_ns: int) -> Unit:
        first, last = slices[0], self._last
        complete = [part.slice_index for part in slices] == list(range(first.slices))
        follows = complete and last is not None and _is_next(last, first)
        self._last = first if complete else None
        starts = complete and first.kind is FrameType.IDR
        return Unit(b"".join(part.payload for part in slices), arrival_ns, settled_ns, starts, follows)


def _is_next(last: PaveFrame, frame: PaveFrame) -> bool:
    same = (last.width, last.height, last.stream) == (frame.width, frame.height, frame.stream)
    return same and frame.number == last.number + 1


class ArDroneReader:
    """Receives the video of one drone."""

    def __init__(self, address: tuple[str, int], interface: str = "") -> None:
        self._line = Line(*address, interface)
        self.name = self._line.name
        self.rejected: Counter[str] = Counter()
        self.decoder: PictureDecoder | None = H264Decoder(self.rejected)

    def interrupt(self) -> None:
        """Make `read` return."""
        self._line.interrupt()

    def read(self, drain: Drain) -> None:
        """Hand over pictures until the drain closes."""
        try:
            with self._line.open() as connection:
                reader, assembly = FrameReader(), Assembly()
                drain.opened()
                while not drain.closing:
                    data = connection.recv(_READ_BYTES)
                    if not data:
                        raise DriverError("the drone closed the stream")
                    drain.keep(assembly.units(reader.feed(data), clock.now_ns()))
                    self.rejected["pave_bytes"] += reader.skipped
                    reader.skipped = 0
        except ConnectionRefusedError:
            hint = "no video over TCP here (an AR.Drone 1 sends its own by UDP, which is not supported)"
            raise DriverError(f"connection refused: {hint}") from None

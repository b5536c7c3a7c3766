"""A serial radio or line: the same frames in a stream of bytes, with one or more vehicles at the other end."""

import os
import select
import threading
from collections import Counter
from contextlib import suppress

from drivers.mavlink.links.frame_codec import FrameCodec
from drivers.mavlink.links.seam import Heard, Sniffer, Transport, ignore_bytes
from drivers.mavlink.links.tty import open_raw
from drivers.mavlink.other_stations import speaks_as_we
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import Message
from drivers.mavlink.wire.signature import frame_size
from drivers.mavlink.wire.verification import Signing
from groundstation.adapters import Address
from groundstation.bus import clock
from groundstation.errors import DriverError

_POLL_S = 0.1
_CHUNK = 4096


class StreamCutter:
    """Finds frames in a stream of bytes that may begin, end and break anywhere."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Return the frames that are complete by now; bytes that belong to none are skipped."""
        buffer, frames = self._buffer, []
        buffer += data
        while len(buffer) >= 3:
            try:
                size = frame_size(buffer)
            except WireError:
                del buffer[0]
                continue
            if len(buffer) < size:
                break
            frames.append(bytes(buffer[:size]))
            # A false start may hide a true frame: only a confirmed checksum lets a whole frame be skipped, by the
            # caller's count of refusals; at most one frame is lost with it.
            del buffer[:size]
        return frames


class SerialLink(Transport):
    """A terminal device, raw, 8N1; after a failure it is reopened, ten times a second."""

    def __init__(self, settings: LinkSettings, signing: Signing | None = None, sniffer: Sniffer = ignore_bytes) -> None:
        _, device, baud = settings.target.split(":")
        self.rejected: Counter[str] = Counter()
        self._codec = FrameCodec(settings, signing)
        self._cutter, self._lock, self._sniffer = StreamCutter(), threading.RLock(), sniffer
        self._closed = False
        self._device, self._baud = device, int(baud)
        self._fd = open_raw(self._device, self._baud)

    @property
    def called_from(self) -> tuple[Address, ...]:
        """Return no address: nobody calls over a line."""
        return ()

    @property
    def newest_stamp(self) -> int:
        """Return the newest time of signing, received or sent; 0 without a key."""
        return self._codec.newest_stamp

    def receive_raw(self) -> list[tuple[Heard, bytes]]:
        """Wait up to 0.1 s for bytes; return the frames complete by now, each with its bytes."""
        try:
            ready, _, _ = select.select([self._fd], [], [], _POLL_S)
            if not ready:
                return []
            data = os.read(self._fd, _CHUNK)
        except (OSError, ValueError):  # ValueError: the device was unplugged, and is not back yet
            data = b""
        if not data:  # an unplugged radio fails, or ends, at once and forever: do not spin
            self.rejected["receive_failed"] += 1
            select.select([], [], [], _POLL_S)
            self._open_anew()
            return []
        now_ns, heard = clock.now_ns(), list[tuple[Heard, bytes]]()
        for raw in self._cutter.feed(data):
            try:
                frame = self._codec.decode(raw)
            except WireError as error:
                self.rejected[error.reason] += 1
                continue
            if not speaks_as_we(frame, self._codec.own, self.rejected):
                self._sniffer(frame.system, now_ns, raw, True)
                heard.append((Heard(now_ns, frame), raw))
        return heard

    def _open_anew(self) -> None:
        """Reopen the device: a radio that was replugged, or lost its supply, is a new device."""
        with self._lock:
            if self._closed:
                return
            self._release()
            with suppress(DriverError):
                self._fd = open_raw(self._device, self._baud)
        self._cutter = StreamCutter()

    def _release(self) -> None:
        if self._fd >= 0:
            os.close(self._fd)
        self._fd = -1

    def send(self, system: int, message: Message) -> None:
        """Write one frame; a line that is too slow loses it."""
        with self._lock:  # signed frames must leave in the order of their times
            self.send_raw(system, self._codec.encode(message))

    def send_raw(self, system: int, data: bytes) -> None:
        """Write whole frames; a line that is too slow loses them."""
        with self._lock:
            try:
                if os.write(self._fd, data) < len(data):
                    self.rejected["send_cut"] += 1
            except OSError:
                self.rejected["send_failed"] += 1
        self._sniffer(system, clock.now_ns(), data, False)

    def close(self) -> None:
        """Close the device."""
        with self._lock:
            self._closed = True
            self._release()

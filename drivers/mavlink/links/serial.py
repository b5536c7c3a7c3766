"""A serial radio or line: the same frames in a stream of bytes, with one or more vehicles at the other end."""

import logging
import os
import select
import threading
from contextlib import suppress

from drivers.mavlink.links.frame_codec import FrameCodec
from drivers.mavlink.links.refusals import LinkRefusals
from drivers.mavlink.links.seam import Heard, Sniffer, Transport, ignore_bytes
from drivers.mavlink.links.stream_cutter import StreamCutter
from drivers.mavlink.links.tty import BITS_PER_BYTE, open_raw
from drivers.mavlink.other_stations import speaks_as_we
from drivers.mavlink.send_queue import SendQueue, Waiting
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import Message, split
from drivers.mavlink.wire.signature import MAGIC_1
from drivers.mavlink.wire.verification import Signing, old_sender
from groundstation.adapters import Address
from groundstation.bus import clock
from groundstation.errors import DriverError
from groundstation.time_units import NS_PER_S

_POLL_S = 0.1
# How soon a line is tried again that took a part of a frame, or nothing.
_RETRY_S = 0.01
_CHUNK = 4096
_log = logging.getLogger(__name__)


class SerialLink(Transport):
    """A terminal device, raw, 8N1; after a failure it is reopened, ten times a second.

    What the line has no time for waits (`SendQueue`), and a thread writes it when there is; frames leave as wholes.
    """

    def __init__(self, settings: LinkSettings, signing: Signing | None = None, sniffer: Sniffer = ignore_bytes) -> None:
        _, device, baud = settings.target.split(":")
        self.rejected = LinkRefusals()
        self._codec = FrameCodec(settings, signing)
        self._cutter, self._sniffer, self._signed = StreamCutter(), sniffer, signing is not None
        self._device, self._baud = device, int(baud)
        self._fd = open_raw(self._device, self._baud)
        self._queue = SendQueue(self._baud / BITS_PER_BYTE, self._note_dropped)
        self._rest = b""  # of the frame that was begun
        self._closed, self._line = False, threading.Condition()
        self._writer = threading.Thread(target=self._write_waiting, name="mavlink line", daemon=True)
        self._writer.start()

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
            if raw[0] == MAGIC_1:
                self._hear_old(now_ns, raw)
                continue
            try:
                frame = self._codec.decode(raw)
            except WireError as error:
                self.rejected[error.reason] += 1
                continue
            if not speaks_as_we(frame, self._codec.own, self.rejected):
                self._sniffer(frame.system, now_ns, raw, True)
                heard.append((Heard(now_ns, frame), raw))
        return heard

    def _hear_old(self, now_ns: int, raw: bytes) -> None:
        """Count a frame of MAVLink 1, and record it unless the link is signed."""
        self.rejected["mavlink_1"] += 1
        if not self._signed:
            self._sniffer(old_sender(raw), now_ns, raw, True)

    def _open_anew(self) -> None:
        """Reopen the device: a radio that was replugged, or lost its supply, is a new device."""
        with self._line:
            if self._closed:
                return
            self._release()
            self._rest = b""
            with suppress(DriverError):
                self._fd = open_raw(self._device, self._baud)
        self._cutter = StreamCutter()

    def _release(self) -> None:
        if self._fd >= 0:
            os.close(self._fd)
        self._fd = -1

    def send(self, system: int, message: Message) -> None:
        """Send a message as soon as the line has time for it."""
        self._put(system, message)

    def send_raw(self, system: int, data: bytes) -> None:
        """Send whole frames as soon as the line has time for them."""
        try:
            self._put(system, *split(data, old=True))
        except WireError as error:
            self.rejected[error.reason] += 1

    def _put(self, system: int, *contents: Message | bytes) -> None:
        with self._line:
            for content in contents:
                self._queue.put(clock.now_ns(), system, content)
            self._write_due()
            self._line.notify()

    def _write_waiting(self) -> None:
        with self._line:
            while not self._closed:
                try:
                    self._write_due()
                except Exception:  # noqa: BLE001 - a landing may wait behind whatever failed: count, log, go on
                    self.rejected["internal"] += 1
                    _log.exception("a frame could not be sent")
                self._line.wait(self._patience_s())

    def _patience_s(self) -> float | None:
        if self._rest:
            return _RETRY_S
        wait_ns = self._queue.wait_ns(clock.now_ns())
        return None if wait_ns is None else max(_RETRY_S, wait_ns / NS_PER_S)

    def _write_due(self) -> None:
        """Write what the line has time for, the rest of a begun frame first: a cut frame would spoil the next too."""
        while self._fd < 0 or select.select([], [self._fd], [], 0.0)[1]:
            if not self._rest:
                waiting = self._queue.take(clock.now_ns())
                if waiting is None:
                    return
                self._rest = self._begin(waiting)
            if not self._write_rest():
                return

    def _begin(self, waiting: Waiting) -> bytes:
        """Return the bytes of a frame; encoded now, because signed ones must leave in the order of their times."""
        now_ns, content = clock.now_ns(), waiting.content
        try:
            frame = content if isinstance(content, bytes) else self._codec.encode(content)
        except WireError as error:
            self.rejected[error.reason] += 1
            return b""
        self._queue.note_sent(now_ns, len(frame))
        self._sniffer(waiting.system, now_ns, frame, False)
        return frame

    def _write_rest(self) -> bool:
        """Write the rest of a frame, as far as the device takes it; return whether that was all of it."""
        try:
            self._rest = self._rest[os.write(self._fd, self._rest) :]
        except BlockingIOError:
            return False
        except OSError:
            self.rejected["send_failed"] += 1
            self._rest = b""
        return not self._rest

    def _note_dropped(self) -> None:
        self.rejected["send_dropped"] += 1

    def close(self) -> None:
        """End the writer and close the device."""
        with self._line:
            self._closed = True
            self._line.notify()
            self._release()
        self._writer.join(timeout=1.0)

"""The port behind which vehicles are: datagrams or a serial line, who may speak, who is where, signing.

`Link` is the seam: the driver sends and receives messages; how they travel is this file's or `mavsdk_link.py`'s.
"""

import logging
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Protocol

from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import MAX_DATAGRAM, Decoder, Encoder, Frame, Message, Signing, frame_size, split
from groundstation.bus import clock
from groundstation.errors import DriverError

_POLL_S = 0.1
_ADDRESS_HELD_NS = 3_000_000_000
_SIGNING_EPOCH_S = 1_420_070_400  # 2015-01-01 UTC
_log = logging.getLogger(__name__)
Sniffer = Callable[[int, int, bytes, bool], None]  # system, stamp_ns, bytes, received


class Heard(NamedTuple):
    """A frame and when it came."""

    stamp_ns: int
    frame: Frame


class Link(Protocol):
    """One port with any number of vehicles behind it. Nothing that arrives raises; refusals are counted by reason."""

    rejected: Counter[str]

    def receive(self) -> list[Heard]:
        """Wait up to 0.1 s; return what came."""

    def send(self, system: int, message: Message) -> None:
        """Send to one vehicle; never blocks, a message to a vehicle that was never heard may be lost."""

    def close(self) -> None:
        """Give the port back."""


class Transport(Link, Protocol):
    """A link that can also be used for frames that somebody else takes apart and makes."""

    def receive_raw(self) -> list[tuple[Heard, bytes]]:
        """Wait up to 0.1 s; return what came, and the bytes of each frame."""

    def send_raw(self, system: int, data: bytes) -> None:
        """Send whole frames to one vehicle; never blocks."""


def ignore_bytes(system: int, stamp_ns: int, data: bytes, received: bool) -> None:
    """Sniff nothing."""


def open_link(settings: LinkSettings, sniffer: Sniffer = ignore_bytes) -> Link:
    """Return the link that the settings describe; raises DriverError when it cannot be opened."""
    transport: Transport
    if settings.target.startswith("serial"):
        from drivers.mavlink.serial_link import SerialLink

        transport = SerialLink(settings, signing_of(settings), sniffer)
    else:
        transport = UdpLink(settings, signing_of(settings), sniffer)
    if settings.kind == "pymavlink":
        return transport
    from drivers.mavlink.mavsdk_link import MavsdkLink

    return MavsdkLink(settings, transport)


def signing_of(settings: LinkSettings) -> Signing | None:
    """Return the key of a signed link, with the time from which we sign; raises DriverError without naming the key."""
    if not settings.key_file:
        return None
    try:
        raw = Path(settings.key_file).read_bytes()
    except OSError as error:
        raise DriverError(f"signing key {settings.key_file}: {error.strerror}") from error
    try:
        key = raw if len(raw) == 32 else bytes.fromhex(raw.decode("ascii").strip())
    except ValueError:
        key = b""
    if len(key) != 32:
        raise DriverError(f"signing key {settings.key_file}: must hold 32 bytes, raw or as 64 hex digits")
    return Signing(key, round((time.time() - _SIGNING_EPOCH_S) * 100_000))


class UdpLink:
    """Datagrams. `udpout` speaks to one address; `udpin` waits for vehicles and remembers where each one is.

    WIRE (mavlink.md 5.6): one socket for many vehicles needs an address per system id, or commands go astray.
    """

    def __init__(self, settings: LinkSettings, signing: Signing | None = None, sniffer: Sniffer = ignore_bytes) -> None:
        way, address, port = settings.target.split(":")
        self.rejected: Counter[str] = Counter()
        self._peer = (address, int(port)) if way == "udpout" else None
        self._addresses: dict[int, tuple[tuple[str, int], int]] = {}
        self._decoder = Decoder(signing)
        self._encoder = Encoder(settings.system_id, settings.component_id, signing)
        self._lock = threading.Lock()
        self._sniffer = sniffer
        self._own = (settings.system_id, settings.component_id)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(("", 0) if self._peer else (address, int(port)))
        except OSError as error:
            self._socket.close()
            raise DriverError(f"cannot listen on {settings.target}: is another program using it? ({error})") from error
        self._socket.settimeout(_POLL_S)

    def receive(self) -> list[Heard]:
        """Wait up to 0.1 s for a datagram; return its frames."""
        return [heard for heard, _ in self.receive_raw()]

    def receive_raw(self) -> list[tuple[Heard, bytes]]:
        """Wait up to 0.1 s for a datagram; return its frames, each with its bytes."""
        try:
            data, source = self._socket.recvfrom(MAX_DATAGRAM)
        except TimeoutError:
            return []
        except OSError as error:
            # An ICMP "port unreachable" answers what was sent to a vehicle that is not there yet.
            self._reject("receive_failed", str(error))
            return []
        return self._judge(clock.now_ns(), data, source)

    def _judge(self, now_ns: int, data: bytes, source: tuple[str, int]) -> list[tuple[Heard, bytes]]:
        heard: list[tuple[Heard, bytes]] = []
        if self._peer is not None and source[0] != self._peer[0]:
            self._reject("foreign_address", f"{source[0]}:{source[1]}")
            return heard
        try:
            for raw in split(data):
                frame = self._decode(raw)
                if frame is None or (frame.system, frame.component) == self._own:
                    continue
                if self._is_at(now_ns, frame.system, source):
                    self._sniffer(frame.system, now_ns, raw, True)
                    heard.append((Heard(now_ns, frame), raw))
        except WireError as error:
            self._reject(error.reason, str(error))
        return heard

    def _decode(self, raw: bytes) -> Frame | None:
        try:
            return self._decoder.decode(raw)
        except WireError as error:
            self._reject(error.reason, str(error))
            return None

    def _is_at(self, now_ns: int, system: int, source: tuple[str, int]) -> bool:
        known = self._addresses.get(system)
        if known is not None and known[0] != source and now_ns - known[1] < _ADDRESS_HELD_NS:
            self._reject("duplicate_system", f"system {system} at {source[0]}:{source[1]} and {known[0]}")
            return False
        self._addresses[system] = (source, now_ns)
        return True

    def _reject(self, reason: str, detail: str) -> None:
        self.rejected[reason] += 1
        _log.debug("%s: %s", reason, detail)

    def send(self, system: int, message: Message) -> None:
        """Send one message in one datagram."""
        if self._address_of(system) is None:
            return
        with self._lock:
            self.send_raw(system, self._encoder.encode(message))

    def _address_of(self, system: int) -> tuple[str, int] | None:
        known = self._addresses.get(system)
        return known[0] if known is not None else self._peer

    def send_raw(self, system: int, data: bytes) -> None:
        """Send whole frames in one datagram to where the vehicle was last heard."""
        address = self._address_of(system)
        if address is None:
            return
        try:
            self._socket.sendto(data, address)
        except OSError as error:
            self._reject("send_failed", str(error))
        self._sniffer(system, clock.now_ns(), data, False)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class StreamCutter:
    """Finds frames in a stream of bytes that may begin, end and break anywhere."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Return the whole frames that the stream holds by now; bytes that belong to none are skipped."""
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
            # A false start may hide a true frame: only what a checksum confirms is skipped as a whole, by the caller's
            # count of refusals; at most one frame is lost with it.
            del buffer[:size]
        return frames

"""Where pictures come from: a drain thread reads everything at once and keeps only the newest frame and its arrival.

A plain read loop would hand over pictures seconds old after a stall; draining keeps them as young as the link allows.
"""

import socket
import threading
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol
from urllib.parse import urlsplit

from drivers.camera.multipart import MultipartParser, boundary_from_head
from groundstation.bus import clock
from groundstation.errors import DriverError

_FIRST_BACK_OFF_S = 0.2
_LAST_BACK_OFF_S = 1.0
_READ_BYTES = 1 << 16
_READ_TIMEOUT_S = 2.0
_CONNECT_TIMEOUT_S = 2.0
_MAX_HEAD_BYTES = 8192


@dataclass(frozen=True, slots=True)
class Packet:
    """One compressed picture as it came, with its arrival time [ns, boot clock] and its number in the stream."""

    data: bytes
    arrival_ns: int
    number: int


class FrameSource(Protocol):
    """Anything that delivers compressed pictures; a file or a folder would be one more."""

    @property
    def connected(self) -> bool:
        """Return whether the source can deliver at the moment."""

    @property
    def detail(self) -> str:
        """Return what is wrong when it cannot."""

    @property
    def received(self) -> int:
        """Return how many pictures have arrived, taken or not."""

    def take_newest(self, timeout_s: float) -> Packet | None:
        """Return the newest picture not yet taken, waiting for one at most that long."""

    def close(self) -> None:
        """Stop reading; idempotent."""


class MjpegSource:
    """MJPEG over HTTP from a network camera; reconnects with back-off for as long as it is open.

    `rejected` counts what was refused, by reason.
    """

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        try:
            port = parts.port or 80
        except ValueError:
            raise DriverError(f"camera source {url}: the port is no number") from None
        if parts.scheme != "http" or not parts.hostname:
            raise DriverError(f"camera source {url}: only http://host:port/path is known")
        self._address = (parts.hostname, port)
        self._path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        self._condition = threading.Condition()
        self._packet: Packet | None = None
        self._socket: socket.socket | None = None
        self._closing = threading.Event()
        self._connected = False
        self._detail = f"connecting to {self._name}"
        self._received = 0
        self.rejected: Counter[str] = Counter()
        self._thread = threading.Thread(target=self._drain_for_ever, name="camera-drain", daemon=True)
        self._thread.start()

    @property
    def _name(self) -> str:
        return f"{self._address[0]}:{self._address[1]}"

    @property
    def connected(self) -> bool:
        """Return whether the stream is open."""
        return self._connected

    @property
    def detail(self) -> str:
        """Return why it is not open."""
        return self._detail

    @property
    def received(self) -> int:
        """Return how many pictures have arrived, taken or not."""
        return self._received

    def take_newest(self, timeout_s: float) -> Packet | None:
        """Return the newest picture not yet taken, waiting for one at most that long."""
        with self._condition:
            if self._packet is None:
                self._condition.wait(timeout_s)
            packet, self._packet = self._packet, None
            return packet

    def close(self) -> None:
        """Stop reading; idempotent."""
        self._closing.set()
        if self._socket is not None:
            with suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
        self._thread.join(timeout=3.0)

    def _drain_for_ever(self) -> None:
        back_off_s = _FIRST_BACK_OFF_S
        while not self._closing.is_set():
            before = self._received
            try:
                with socket.create_connection(self._address, timeout=_CONNECT_TIMEOUT_S) as connection:
                    self._socket = connection
                    self._drain(connection)
            except (OSError, DriverError) as error:
                self._detail = f"{self._name}: {error}"
            self._connected = False
            back_off_s = _FIRST_BACK_OFF_S if self._received > before else min(2 * back_off_s, _LAST_BACK_OFF_S)
            self._closing.wait(back_off_s)

    def _drain(self, connection: socket.socket) -> None:
        connection.settimeout(_READ_TIMEOUT_S)
        request = f"GET {self._path} HTTP/1.0\r\nHost: {self._name}\r\nAccept: multipart/x-mixed-replace\r\n\r\n"
        connection.sendall(request.encode("ascii", "replace"))
        boundary, rest = _read_head(connection)
        parser = MultipartParser(boundary)
        self._keep(parser.feed(rest))
        self._connected, self._detail = True, ""
        while not self._closing.is_set():
            data = connection.recv(_READ_BYTES)
            if not data:
                raise DriverError("the camera closed the stream")
            frames = parser.feed(data)
            if frames:
                self._keep(frames)
            self.rejected["multipart"] += parser.rejected
            parser.rejected = 0

    def _keep(self, frames: list[bytes]) -> None:
        if not frames:
            return
        arrival_ns = clock.now_ns()
        with self._condition:
            self._received += len(frames)
            self._packet = Packet(frames[-1], arrival_ns, self._received)
            self._condition.notify()


def _read_head(connection: socket.socket) -> tuple[bytes, bytes]:
    """Return the boundary and what follows the response head; raises DriverError when it is no MJPEG stream."""
    head = b""
    while b"\r\n\r\n" not in head:
        data = connection.recv(4096)
        if not data or len(head) > _MAX_HEAD_BYTES:
            raise DriverError("no HTTP answer")
        head += data
    head, rest = head.split(b"\r\n\r\n", 1)
    status = head.split(b"\r\n", 1)[0].split()
    if len(status) < 2 or not status[0].startswith(b"HTTP/") or status[1] != b"200":
        raise DriverError(f"the camera answered {b' '.join(status[:3]).decode('ascii', 'replace')!r}")
    boundary = boundary_from_head(head)
    if not boundary:
        raise DriverError("the answer is no multipart stream")
    return boundary, rest


def open_source(source: str) -> FrameSource:
    """Return the reader for a source address; raises DriverError for a kind that is not known."""
    return MjpegSource(source)

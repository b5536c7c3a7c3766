"""MJPEG over HTTP, as network cameras send it (`http://host:port/path`)."""

import socket
from base64 import b64encode
from collections import Counter

from drivers.camera.multipart import MultipartParser, boundary_from_head
from drivers.camera.sources.frames import Unit
from drivers.camera.sources.reader_thread import Drain, PictureDecoder
from drivers.camera.sources.tcp import Line
from groundstation.bus import clock
from groundstation.errors import DriverError

_READ_BYTES = 1 << 16
_MAX_HEAD_BYTES = 8192


class MjpegReader:
    """Asks for a stream and cuts it into JPEGs; login: "user:password", or "" if none is needed."""

    decoder: PictureDecoder | None = None

    def __init__(self, host: str, port: int, path: str, login: str = "", interface: str = "") -> None:
        self._line = Line(host, port, interface)
        self.name = self._line.name
        self.rejected: Counter[str] = Counter()
        request = f"GET {path} HTTP/1.0\r\nHost: {host}:{port}\r\nAccept: multipart/x-mixed-replace\r\n"
        # WIRE (RFC 7617): sent with the first request; a camera that requires Digest still answers 401.
        secret = f"Authorization: Basic {b64encode(login.encode()).decode()}\r\n" if login else ""
        self._request = f"{request}{secret}\r\n".encode("ascii", "replace")

    def interrupt(self) -> None:
        """Make `read` return."""
        self._line.interrupt()

    def read(self, drain: Drain) -> None:
        """Hand over pictures until the drain closes."""
        with self._line.open() as connection:
            connection.sendall(self._request)
            boundary, data = _read_head(connection)
            parser = MultipartParser(boundary)
            drain.opened()
            while not drain.closing:
                arrival_ns = clock.now_ns()
                drain.keep([Unit(jpeg, arrival_ns, arrival_ns) for jpeg in parser.feed(data)])
                self.rejected["multipart"] += parser.rejected
                parser.rejected = 0
                data = connection.recv(_READ_BYTES)
                if not data:
                    raise DriverError("the camera closed the stream")


def _read_head(connection: socket.socket) -> tuple[bytes, bytes]:
    """Return the boundary and the bytes after the response head; raises DriverError if it is no MJPEG stream."""
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

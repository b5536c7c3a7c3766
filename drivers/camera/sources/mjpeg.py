"""MJPEG over HTTP, as network cameras send it (`http://host:port/path`)."""

import socket
from base64 import b64encode
from collections import Counter
from collections.abc import Sequence
from secrets import token_hex

from drivers.camera.digest import Challenge, authorization, challenge_of
from drivers.camera.http_answer import (
    ChunkedBody,
    boundary_from_body,
    boundary_from_head,
    is_chunked,
    location_of,
    may_begin_with_boundary,
    split_answer,
)
from drivers.camera.multipart import MultipartParser
from drivers.camera.sources.frames import Unit
from drivers.camera.sources.held_back import Cadence
from drivers.camera.sources.jitter_filter import SenderClock
from drivers.camera.sources.reader_thread import Drain, PictureDecoder
from drivers.camera.sources.tcp import Line
from groundstation.bus import clock
from groundstation.errors import DriverError

_READ_BYTES = 1 << 16
_MAX_HEAD_BYTES = 8192


class MjpegReader:
    """Requests a stream and cuts it into JPEGs; login: "user:password", or "" if none is needed."""

    decoder: PictureDecoder | None = None

    def __init__(self, host: str, port: int, path: str, login: str = "", interface: str = "") -> None:
        self._line = Line(host, port, interface)
        self.name = self._line.name
        self.rejected: Counter[str] = Counter()
        self._host, self._path, self._login = f"{host}:{port}", path, login
        self._wants_digest = False

    def interrupt(self) -> None:
        """Make `read` return."""
        self._line.interrupt()

    def read(self, drain: Drain) -> None:
        """Hand over pictures until the drain closes."""
        challenge = self._read_as(drain, None)
        if challenge is not None:
            self._wants_digest = True
            self._read_as(drain, challenge)

    def _read_as(self, drain: Drain, challenge: Challenge | None) -> Challenge | None:
        """Hand over pictures; returns at once with the challenge of a camera that wants a login by Digest."""
        with self._line.open() as connection:
            connection.sendall(self._request(challenge))
            head, rest = _read_head(connection)
            wanted = (
                challenge_of(head) if self._login and challenge is None and _status(head)[1:2] == [b"401"] else None
            )
            if wanted is not None:
                return wanted
            _require_success(head)
            body = _Body(connection, ChunkedBody() if is_chunked(head) else None, rest)
            parser = MultipartParser(body.boundary(boundary_from_head(head)))
            dates, data = _Dates(), body.begun
            drain.opened()
            while not drain.closing:
                arrival_ns = clock.now_ns()
                jpegs = parser.feed(data)
                drain.keep(dates.units(jpegs, parser.stamps_ns, arrival_ns))
                self.rejected["multipart"] += parser.rejected
                parser.rejected = 0
                data = body.read()
        return None

    def _request(self, challenge: Challenge | None) -> bytes:
        request = f"GET {self._path} HTTP/1.0\r\nHost: {self._host}\r\nAccept: multipart/x-mixed-replace\r\n"
        secret = ""
        if challenge is not None:
            secret = authorization(challenge, self._login, self._path, token_hex(8))
        elif self._login and not self._wants_digest:
            # WIRE (RFC 7617): sent with the first request; not again to a camera that has asked for Digest.
            secret = f"Basic {b64encode(self._login.encode()).decode()}"
        if secret:
            request += f"Authorization: {secret}\r\n"
        return f"{request}\r\n".encode("ascii", "replace")


class _Dates:
    """Dates the pictures of one connection: by the sender's stamps once they prove true, else by their arrival."""

    def __init__(self) -> None:
        self._clock, self._cadence = SenderClock(), Cadence()

    def units(self, jpegs: Sequence[bytes], stamps_ns: Sequence[int | None], arrival_ns: int) -> list[Unit]:
        """Return pictures that arrived together, oldest first."""
        # The cadence learns from every picture, also while stamps prove true: they may end.
        old = [self._cadence.holds_back(arrival_ns) for _ in jpegs]
        sent_ns = [stamp for stamp in stamps_ns if stamp is not None]
        if jpegs and len(sent_ns) == len(jpegs):
            settled_ns = self._clock.settle(sent_ns, arrival_ns)
            if self._clock.proven:  # then a picture is dated, however late it comes
                return [Unit(jpeg, arrival_ns, when_ns) for jpeg, when_ns in zip(jpegs, settled_ns, strict=True)]
        return [Unit(jpeg, arrival_ns, arrival_ns, held_back=one) for jpeg, one in zip(jpegs, old, strict=True)]


class _Body:
    """The body of an HTTP answer: the bytes behind its head."""

    def __init__(self, connection: socket.socket, chunks: ChunkedBody | None, rest: bytes) -> None:
        self._connection, self._chunks = connection, chunks
        self.begun = self._carried(rest)

    def read(self) -> bytes:
        """Return the next bytes; raises DriverError at the end, OSError after 2 s of silence."""
        data = self._connection.recv(_READ_BYTES)
        if not data or (self._chunks is not None and self._chunks.ended):
            raise DriverError("the camera closed the stream")
        return self._carried(data)

    def boundary(self, announced: bytes | None) -> bytes:
        """Return the announced boundary, else that with which the body begins; raises DriverError without any."""
        if announced:
            return announced
        while may_begin_with_boundary(self.begun):  # ffmpeg announces none
            self.begun += self.read()
        boundary = boundary_from_body(self.begun)
        if not boundary:
            raise DriverError("the answer is no multipart stream")
        return boundary

    def _carried(self, data: bytes) -> bytes:
        return data if self._chunks is None else self._chunks.feed(data)


def _read_head(connection: socket.socket) -> tuple[bytes, bytes]:
    """Return the head of an answer and the bytes behind it; raises DriverError if it is none of HTTP."""
    data = b""
    while (parts := split_answer(data)) is None:
        more = connection.recv(4096)
        if not more or len(data) > _MAX_HEAD_BYTES:
            raise DriverError("no HTTP answer")
        data += more
    return parts


def _status(head: bytes) -> list[bytes]:
    return head.split(b"\n", 1)[0].split()


def _require_success(head: bytes) -> None:
    status = _status(head)
    if len(status) < 2 or not status[0].startswith(b"HTTP/") or status[1] != b"200":
        answer = f"the camera answered {b' '.join(status[:3]).decode('ascii', 'replace')!r}"
        moved_to = location_of(head) if status[1:2] and status[1].startswith(b"3") else ""
        raise DriverError(f"{answer}: give {moved_to} as its address" if moved_to else answer)

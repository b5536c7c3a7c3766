"""Pictures that a ROS 2 node publishes, by a client of its Zenoh router (`ros2://HOST:PORT/TOPIC?domain=N`).

It only subscribes. Stamps are of the sender's clock: they serve to remove jitter, not as times.
"""

import struct
import threading
from collections import Counter, deque

import cv2
import numpy as np

from drivers.camera.sources.frames import Matrix, Unit
from drivers.camera.sources.jitter_filter import SenderClock
from drivers.camera.sources.raw import Decoded
from drivers.camera.sources.reader_thread import Drain, PictureDecoder
from drivers.rmw_zenoh.publisher_tie import PublisherTie
from drivers.rmw_zenoh.session import RouterSession
from drivers.rmw_zenoh.wire import graph, pictures
from drivers.rmw_zenoh.wire.cdr import WireError
from groundstation.bus import clock
from groundstation.errors import DriverError

_OPEN_LIMIT_S, _WAIT_S = 3.0, 0.2
_WAITING = 8
_JPEG, _PNG = b"\xff\xd8", b"\x89PNG\r\n\x1a\n"
_DDS = "::msg::dds_::"


class Ros2Reader:
    """Subscribes to one topic: sensor_msgs/CompressedImage (JPEG, PNG) or Image (mono8, rgb8, bgr8).

    Pictures of a second publisher are refused: they may be another camera's.
    """

    def __init__(self, host: str, port: int, topic: str, domain: int) -> None:
        self._endpoint, self._expression = f"tcp/{host}:{port}", graph.heard_key(domain, topic)
        self.name = f"{host}:{port}/{topic.strip('/')}"
        self.rejected: Counter[str] = Counter()
        self.decoder: PictureDecoder | None = None
        # Whether the last message was unreadable: the stream counts as open again only after a readable one.
        self._refused = False
        self._tie, self._settled = PublisherTie(), SenderClock()
        self._waiting: deque[tuple[int, bytes, str, bytes]] = deque(maxlen=_WAITING)
        self._came = threading.Event()

    def interrupt(self) -> None:
        """Make `read` return."""
        self._came.set()

    def read(self, drain: Drain) -> None:
        """Hand over pictures until the drain closes."""
        self._waiting.clear()
        self._settled = SenderClock()
        session = RouterSession(self._endpoint, [self._expression], self._hear)
        try:
            _await_router(session, drain)
            while not drain.closing:
                if not self._refused:
                    drain.opened()
                self._came.wait(_WAIT_S)
                self._came.clear()
                if not session.reaches_router:
                    raise DriverError("the ROS 2 Zenoh router is gone")
                while self._waiting:
                    drain.keep(self._next_units(*self._waiting.popleft()))
        finally:
            session.close()

    def _hear(self, key: str, payload: bytes, publisher: bytes) -> None:
        self._waiting.append((clock.now_ns(), publisher, key.split("/")[-2], payload))
        self._came.set()

    def _next_units(self, arrival_ns: int, publisher: bytes, dds_type: str, payload: bytes) -> list[Unit]:
        """Return the picture of the topic's one publisher; raises as `_units`."""
        if self._tie.is_second(publisher, arrival_ns):
            self.rejected["second publisher"] += 1
            return []
        if self._tie.take(publisher, arrival_ns):
            self._settled = SenderClock()
        return self._units(arrival_ns, dds_type, payload)

    def _units(self, arrival_ns: int, dds_type: str, payload: bytes) -> list[Unit]:
        """Return the picture of a message, or nothing for a damaged one.

        Raises DriverError for another type, format or encoding, naming it.
        """
        self._refused = True
        try:
            if dds_type == pictures.COMPRESSED:
                stamp_ns, data, picture = self._compressed(pictures.decode_compressed(payload))
            elif dds_type == pictures.RAW:
                raw = pictures.decode_raw(payload)
                stamp_ns, data, picture = raw.stamp_ns, b"", _matrix(raw)
            else:
                kind = dds_type.removesuffix("_").replace(_DDS, "/")
                raise DriverError(f"the topic's type is {kind}: only sensor_msgs/CompressedImage and Image are read")
        except WireError as error:
            self.rejected[error.reason] += 1
            return []
        self._refused = False
        self.decoder = None if picture is None else Decoded()
        (settled_ns,) = self._settled.settle([stamp_ns], arrival_ns)
        return [Unit(data, arrival_ns, settled_ns, picture=picture)]

    def _compressed(self, message: pictures.CompressedPicture) -> tuple[int, bytes, Matrix | None]:
        if message.data.startswith(_JPEG):
            return message.stamp_ns, message.data, None
        if not message.data.startswith(_PNG):
            raise DriverError(f"its pictures are {message.format or 'of no known format'}: only JPEG and PNG are read")
        # WIRE (PNG, 11.2.2): width and height stand behind signature, length and name of the first chunk.
        sizes = struct.unpack_from(">II", message.data.ljust(24, b"\0"), 16)
        if max(sizes) > pictures.LARGEST_PX:
            raise WireError("size")
        try:
            pixels = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)
        except cv2.error:  # a picture that claims to be huge
            pixels = None
        if pixels is None:
            raise WireError("unreadable")
        return message.stamp_ns, b"", Matrix(np.asarray(pixels, dtype=np.uint8))


def _await_router(session: RouterSession, drain: Drain) -> None:
    """Wait until the router is there; raises DriverError when it is not in time."""
    deadline_ns = clock.now_ns() + round(_OPEN_LIMIT_S * 1e9)
    while not session.reaches_router:
        if clock.now_ns() > deadline_ns:
            raise DriverError("no ROS 2 Zenoh router answers (ros2 run rmw_zenoh_cpp rmw_zenohd)")
        if drain.wait(0.02):
            return


def _matrix(raw: pictures.RawPicture) -> Matrix:
    """Return the pixels of an Image; raises DriverError for an unsupported encoding."""
    pixel = pictures.ENCODINGS.get(raw.encoding)
    if pixel is None:
        known = ", ".join(pictures.ENCODINGS)
        raise DriverError(f"its pictures are {raw.encoding or 'of no encoding'}: only {known} are read")
    rows = np.frombuffer(raw.data, np.uint8).reshape(raw.height, raw.step)[:, : raw.width * pixel]
    if pixel == 1:
        return Matrix(np.ascontiguousarray(rows))
    colours = rows.reshape(raw.height, raw.width, pixel)
    return Matrix(np.ascontiguousarray(colours[:, :, ::-1] if raw.encoding == "rgb8" else colours))

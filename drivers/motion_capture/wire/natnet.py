"""NatNet 3.0 to 4.2, the stream of OptiTrack's Motive: requests, server information, descriptions, frames.

WIRE (docs/reference/natnet.md 1): little endian; a datagram is message id, size of its payload, payload.
"""

import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

COMMAND_PORT = 1510
CONNECT, SERVER_INFO, REQUEST, RESPONSE, REQUEST_DESCRIPTIONS, DESCRIPTIONS, FRAME = 0, 1, 2, 3, 4, 5, 7
DISCONNECT, KEEP_ALIVE, ECHO_REQUEST, ECHO_RESPONSE, DISCOVERY, UNRECOGNIZED = 9, 10, 12, 13, 14, 100
Version = tuple[int, int]
_OLDEST, _SIZED, _TURNED = (3, 0), (4, 1), (4, 2)
"""Since 4.1 each section is preceded by its size, since 4.2 the offset of a body has a rotation."""
_HEAD, _COUNT, _STAMP = struct.Struct("<HH"), struct.Struct("<i"), struct.Struct("<Q")
_BODY = struct.Struct("<i3f4ffh")
_SERVER = struct.Struct("<256s4B4BQH?4B")
_TAIL = {False: struct.Struct("<dQQQhi"), True: struct.Struct("<dQQQIIhi")}
_NAME_BYTES, _POINT_BYTES, _LABEL_BYTES = 256, 12, 4
_VERSION_AT, _OLD_SERVER_BYTES = 260, 264
_MARKER_SET, _RIGID_BODY = 0, 1
_CHANGED = 2  # of a frame's flags
_MOST = 10_000


class WireError(ValueError):
    """A datagram that cannot be read; `reason` is a word to count it by, `told` a text for the operator, or ""."""

    def __init__(self, reason: str, told: str = "") -> None:
        super().__init__(reason)
        self.reason, self.told = reason, told


@dataclass(frozen=True, slots=True)
class Server:
    """A server: its name, the version of its stream, ticks per second of its stamps, and where it sends frames.

    group: the multicast address, "" for frames to each client's own port.
    """

    name: str
    version: Version
    ticks_per_s: int
    data_port: int
    group: str


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body: streaming id, position [m; the system's axes], quaternion (x, y, z, w), whether it is tracked."""

    id: int
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    tracked: bool = True


@dataclass(frozen=True, slots=True)
class Frame:
    """All rigid bodies of one exposure; exposed, sent: the server's ticks at the middle of the exposure, at sending.

    changed: the descriptions have changed since the frame before.
    """

    number: int
    bodies: tuple[Body, ...]
    exposed: int = 0
    sent: int = 0
    changed: bool = False


def message_of(datagram: bytes) -> tuple[int, bytes]:
    """Return message id and payload; raises WireError if cut short."""
    if len(datagram) < _HEAD.size:
        raise WireError("short")
    kind, size = _HEAD.unpack_from(datagram)
    if kind in (FRAME, DESCRIPTIONS, SERVER_INFO) and len(datagram) < _HEAD.size + size:
        raise WireError("short")
    return kind, datagram[_HEAD.size :]


def encode(kind: int, payload: bytes = b"") -> bytes:
    """Return a datagram."""
    return _HEAD.pack(kind, len(payload)) + payload


def encode_echo(request: bytes, received: int) -> bytes:
    """Return the answer to an echo request: the client's own stamp, and the server's ticks at its arrival."""
    return encode(ECHO_RESPONSE, request[: _STAMP.size].ljust(_STAMP.size, b"\0") + _STAMP.pack(received))


def connect_request() -> bytes:
    """Return the request for frames of version 4.1; the server may answer with another version."""
    payload = bytearray(271)
    payload[:4] = b"Ping"
    payload[265:267] = bytes((4, 1))
    return encode(CONNECT, bytes(payload))


def decode_server(payload: bytes) -> Server:
    """Return a server's description of itself; raises WireError if cut short, and for versions before 3.0."""
    if len(payload) < _OLD_SERVER_BYTES:
        raise WireError("short")
    version = (payload[_VERSION_AT], payload[_VERSION_AT + 1])
    if version < _OLDEST:  # its description ends here
        raise WireError("version", "it streams NatNet {}.{}; versions from 3.0 (Motive 2) on are read".format(*version))
    if len(payload) < _SERVER.size:
        raise WireError("short")
    name, *rest = _SERVER.unpack_from(payload)
    ticks, port, multicast, group = rest[8], rest[9], rest[10], rest[11:15]
    address = ".".join(map(str, group)) if multicast else ""
    return Server(name.partition(b"\0")[0].decode("utf-8", "replace"), version, ticks, port, address)


def encode_server(server: Server) -> bytes:
    """Return the datagram with which a server answers."""
    group = [int(part) for part in server.group.split(".")] if server.group else [0, 0, 0, 0]
    named = server.name.encode()[: _NAME_BYTES - 1]
    payload = _SERVER.pack(
        named, *(1, 0, 0, 0), *server.version, 0, 0, server.ticks_per_s, server.data_port, bool(server.group), *group
    )
    return encode(SERVER_INFO, payload)


class _Reader:
    """Reads a payload in order; reading beyond its end raises WireError."""

    def __init__(self, payload: bytes, version: Version) -> None:
        self.payload, self.version, self.at = payload, version, 0

    def count(self) -> int:
        """Return the next integer, a count."""
        (value,) = self.take(_COUNT)
        if not 0 <= value <= _MOST:
            raise WireError("count")
        return int(value)

    def take(self, form: struct.Struct) -> tuple[int, ...]:
        """Return the next values of a form."""
        if self.at + form.size > len(self.payload):
            raise WireError("short")
        values = form.unpack_from(self.payload, self.at)
        self.at += form.size
        return values

    def skip(self, size: int) -> None:
        """Leave out bytes."""
        if size < 0 or self.at + size > len(self.payload):
            raise WireError("short")
        self.at += size

    def text(self) -> str:
        """Return the next text, which ends with a zero."""
        end = self.payload.find(b"\0", self.at)
        if end < 0:
            raise WireError("short")
        text = self.payload[self.at : end].decode("utf-8", "replace")
        self.at = end + 1
        return text

    def section(self) -> int:
        """Return the number of entries of a frame's section, skipping its size."""
        entries = self.count()
        if self.version >= _SIZED:
            self.take(_COUNT)
        return entries


def decode_frame(payload: bytes, version: Version) -> Frame:
    """Return the rigid bodies of a frame; raises WireError if cut short, or without the proper end."""
    reader = _Reader(payload, version)
    (number,) = reader.take(_COUNT)
    for _ in range(reader.section()):
        reader.text()
        reader.skip(reader.count() * _POINT_BYTES)
    reader.skip(reader.section() * _POINT_BYTES)
    bodies = tuple(_body(reader) for _ in range(reader.section()))
    tail = _TAIL[version >= _SIZED]
    if len(payload) - reader.at < tail.size:
        raise WireError("short")
    # The part in between (skeletons, labelled markers, devices) differs by version; the end is the same.
    *_, end = values = tail.unpack_from(payload, len(payload) - tail.size)
    if end != 0:
        raise WireError("end")
    return Frame(number, bodies, values[1], values[3], bool(values[-2] & _CHANGED))


def _body(reader: _Reader) -> Body:
    identity, x, y, z, qx, qy, qz, qw, _, flags = reader.take(_BODY)
    return Body(identity, (x, y, z), (qx, qy, qz, qw), bool(flags & 1))


def encode_frame(frame: Frame, version: Version) -> bytes:
    """Return the datagram of a frame with rigid bodies only."""
    sized = version >= _SIZED
    bodies = b"".join(
        _BODY.pack(body.id, *body.position, *body.rotation, 0.0, int(body.tracked)) for body in frame.bodies
    )
    # Marker sets, other markers, rigid bodies, skeletons, assets (since 4.1), labelled markers, force plates, devices.
    entries = [(0, b""), (0, b""), (len(frame.bodies), bodies), *[(0, b"")] * (5 if sized else 4)]
    sections = b"".join(
        _COUNT.pack(count) + (_COUNT.pack(len(content)) if sized else b"") + content for count, content in entries
    )
    timecode = struct.pack("<II", 0, 0)
    precision = (0, 0) if sized else ()
    flags = _CHANGED if frame.changed else 0
    tail = _TAIL[sized].pack(frame.number / 100, frame.exposed, frame.exposed, frame.sent, *precision, flags, 0)
    return encode(FRAME, _COUNT.pack(frame.number) + sections + timecode + tail)


def decode_descriptions(payload: bytes, version: Version) -> dict[int, str]:
    """Return the name of each rigid body by its streaming id.

    Before 4.1 only marker sets and rigid bodies can be read: descriptions from the first other kind on are left out.
    """
    reader, names = _Reader(payload, version), dict[int, str]()
    for _ in range(reader.count()):
        (kind,) = reader.take(_COUNT)
        size = reader.take(_COUNT)[0] if version >= _SIZED else None
        begin = reader.at
        if kind == _RIGID_BODY:
            name = reader.text()
            names[int(reader.take(_COUNT)[0])] = name
        if size is not None:  # WIRE (docs/reference/natnet.md 4): what follows the id differs by version
            reader.at = begin
            reader.skip(size)
        elif not _skip_unsized(reader, kind):
            break
    return names


def _skip_unsized(reader: _Reader, kind: int) -> bool:
    """Leave out the rest of a description without a size; returns whether its kind is known."""
    if kind == _RIGID_BODY:
        reader.skip(_COUNT.size + _POINT_BYTES)
        markers = reader.count()
        reader.skip(markers * (_POINT_BYTES + _LABEL_BYTES))
        names = markers if reader.version >= (4, 0) else 0
    elif kind == _MARKER_SET:
        reader.text()
        names = reader.count()
    else:
        return False
    for _ in range(names):
        reader.text()
    return True


def encode_descriptions(names: Mapping[int, str], version: Version) -> bytes:
    """Return the datagram that names rigid bodies by their streaming ids."""
    return encode(DESCRIPTIONS, _COUNT.pack(len(names)) + b"".join(_described(names.items(), version)))


def _described(names: Iterable[tuple[int, str]], version: Version) -> Iterable[bytes]:
    for identity, name in names:
        turn = struct.pack("<4f", 0.0, 0.0, 0.0, 1.0) if version >= _TURNED else b""
        own = name.encode() + b"\0" + struct.pack("<ii3f", identity, -1, 0.0, 0.0, 0.0) + turn + _COUNT.pack(0)
        size = _COUNT.pack(len(own)) if version >= _SIZED else b""
        yield _COUNT.pack(_RIGID_BODY) + size + own

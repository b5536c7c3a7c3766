"""NatNet: datagrams assembled by hand from the wire sheet, truncated ones, and those of strangers."""

import struct

import pytest

from drivers.motion_capture.wire import natnet

BODY = struct.pack("<i3f4ffh", 7, 1.0, 2.0, 3.0, 0.0, 0.0, 0.5, 0.5, 0.001, 1)
LOST = struct.pack("<i3f4ffh", 8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0)
MARKER_SET = b"all\0" + struct.pack("<i", 1) + struct.pack("<3f", 1, 2, 3)


def frame_3_1() -> bytes:
    """A frame of Motive 2: one marker set, one loose marker, two bodies, one labelled marker."""
    body = struct.pack("<ii", 42, 1) + MARKER_SET
    body += struct.pack("<i", 1) + struct.pack("<3f", 4, 5, 6)
    body += struct.pack("<i", 2) + BODY + LOST
    body += struct.pack("<i", 0)  # skeletons
    body += struct.pack("<i", 1) + struct.pack("<i3ffhf", 1, 0, 0, 0, 0.01, 0, 0)  # labelled markers
    body += struct.pack("<ii", 0, 0)  # force plates, devices
    body += struct.pack("<II", 0, 0) + struct.pack("<dQQQhi", 0.42, 1000, 1010, 1050, 0, 0)
    return struct.pack("<HH", 7, len(body)) + body


def frame_4_1() -> bytes:
    """A frame of Motive 3.1: each section has its size after its count."""
    parts = [(1, MARKER_SET), (0, b""), (2, BODY + LOST), (0, b""), (0, b""), (0, b""), (0, b""), (0, b"")]
    body = struct.pack("<i", 42) + b"".join(struct.pack("<ii", n, len(part)) + part for n, part in parts)
    body += struct.pack("<II", 0, 0) + struct.pack("<dQQQIIhi", 0.42, 1000, 1010, 1050, 0, 0, 0, 0)
    return struct.pack("<HH", 7, len(body)) + body


@pytest.mark.parametrize(("datagram", "version"), [(frame_3_1(), (3, 1)), (frame_4_1(), (4, 1))])
def test_the_bodies_of_a_frame_are_read_with_their_stamps(datagram: bytes, version: tuple[int, int]) -> None:
    kind, payload = natnet.message_of(datagram)
    frame = natnet.decode_frame(payload, version)
    assert (kind, frame.number, frame.exposed, frame.sent) == (natnet.FRAME, 42, 1000, 1050)
    followed, lost = frame.bodies
    assert followed == natnet.Body(7, (1.0, 2.0, 3.0), (0.0, 0.0, 0.5, 0.5), tracked=True)
    assert (lost.id, lost.tracked) == (8, False)


@pytest.mark.parametrize(("datagram", "version"), [(frame_3_1(), (3, 1)), (frame_4_1(), (4, 1))])
def test_a_frame_that_is_cut_short_is_refused(datagram: bytes, version: tuple[int, int]) -> None:
    for length in range(0, len(datagram), 3):
        with pytest.raises(natnet.WireError):
            natnet.decode_frame(natnet.message_of(datagram[:length])[1], version)
    payload = datagram[4:]
    for length in range(4, len(payload), 5):
        with pytest.raises(natnet.WireError):
            natnet.decode_frame(payload[:length] + bytes([1, 0, 0, 0])[: min(4, length)], version)


def test_a_count_that_nobody_can_mean_is_refused() -> None:
    payload = bytearray(frame_3_1()[4:])
    payload[4:8] = struct.pack("<i", -5)
    with pytest.raises(natnet.WireError, match="count"):
        natnet.decode_frame(bytes(payload), (3, 1))


def test_emulated_frames_are_decoded_as_those_of_motive() -> None:
    bodies = (natnet.Body(7, (1.0, 2.0, 3.0), (0.0, 0.0, 0.5, 0.5)),)
    for version in ((3, 1), (4, 1)):
        datagram = natnet.encode_frame(natnet.Frame(42, bodies, 1000, 1050), version)
        assert natnet.decode_frame(natnet.message_of(datagram)[1], version).bodies == bodies


def test_a_server_names_itself_its_version_and_where_it_sends() -> None:
    payload = b"Motive".ljust(256, b"\0") + bytes([3, 1, 0, 0, 4, 1, 0, 0])
    payload += struct.pack("<QH?4B", 10_000_000, 1511, True, 239, 255, 42, 99)
    server = natnet.decode_server(payload)
    assert server == natnet.Server("Motive", (4, 1), 10_000_000, 1511, "239.255.42.99")
    assert natnet.message_of(natnet.encode_server(server))[1][264:] == payload[264:]
    alone = natnet.decode_server(payload[:-5] + bytes([0, 0, 0, 0, 0]))
    assert alone.group == ""
    with pytest.raises(natnet.WireError, match="short"):
        natnet.decode_server(payload[:264])


def test_a_server_that_is_too_old_says_its_version_in_a_shorter_answer() -> None:
    with pytest.raises(natnet.WireError, match="version") as caught:
        natnet.decode_server(b"NatNetLib".ljust(256, b"\0") + bytes([2, 9, 0, 0, 2, 9, 0, 0]))
    assert caught.value.told == "it streams NatNet 2.9; versions from 3.0 (Motive 2) on are read"


def described(version: tuple[int, int]) -> bytes:
    sized = version >= (4, 1)
    markers = b"all\0" + struct.pack("<i", 1) + b"m1\0"
    turn = struct.pack("<4f", 0.0087, 0, 0, 0.99996) if version >= (4, 2) else b""
    body = b"cf1\0" + struct.pack("<ii3f", 7, -1, 0, 0, 0) + turn + struct.pack("<i", 1) + bytes(16)
    body += b"m1\0" if version >= (4, 0) else b""
    parts = [(0, markers), (1, body), (5, b"camera\0" + bytes(28))] if sized else [(0, markers), (1, body)]
    sections = (struct.pack("<i", k) + (struct.pack("<i", len(p)) if sized else b"") + p for k, p in parts)
    return struct.pack("<i", len(parts)) + b"".join(sections)


@pytest.mark.parametrize("version", [(3, 0), (4, 0), (4, 1), (4, 2), (4, 3)])
def test_bodies_are_named_by_their_descriptions(version: tuple[int, int]) -> None:
    assert natnet.decode_descriptions(described(version), version) == {7: "cf1"}
    for length in range(len(described(version)) - 1):
        if version < (4, 1) or length < 20:
            with pytest.raises(natnet.WireError):
                natnet.decode_descriptions(described(version)[:length], version)


@pytest.mark.parametrize("version", [(4, 0), (4, 1), (4, 2)])
def test_emulated_descriptions_name_the_bodies(version: tuple[int, int]) -> None:
    names = {7: "cf1", 8: "cf2"}
    payload = natnet.message_of(natnet.encode_descriptions(names, version))[1]
    assert natnet.decode_descriptions(payload, version) == names


def test_a_description_of_impossible_size_is_refused() -> None:
    for size in (-1, 10**6):
        payload = struct.pack("<iii", 1, 1, size) + b"cf1\0" + struct.pack("<i", 7)
        with pytest.raises(natnet.WireError, match="short"):
            natnet.decode_descriptions(payload, (4, 1))


def test_the_request_to_connect_is_that_of_a_natnet_client() -> None:
    kind, payload = natnet.message_of(natnet.connect_request())
    assert (kind, payload[:4], payload[265:269]) == (natnet.CONNECT, b"Ping", bytes([4, 1, 0, 0]))

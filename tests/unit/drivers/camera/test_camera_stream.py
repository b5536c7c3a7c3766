"""The emulated camera's server against plain sockets, and the driver's reader against plain servers."""

import socket
import threading
import time
from base64 import b64encode
from contextlib import contextmanager

import pytest
from patience import wait_for

from drivers.camera.sources.opening import open_source
from groundstation.errors import DriverError
from sim_bridge.devices.camera_stream import CameraStream

JPEG = b"\xff\xd8 picture %d \xff\xd9"


@contextmanager
def streaming():
    stream = CameraStream("127.0.0.1", 0)
    try:
        yield stream
    finally:
        stream.close()


def connect(port, path=b"/video.mjpg"):
    client = socket.create_connection(("127.0.0.1", port), timeout=5.0)
    client.sendall(b"GET " + path + b" HTTP/1.0\r\n\r\n")
    return client


def read_until(client, mark):
    data = b""
    while mark not in data:
        piece = client.recv(65536)
        assert piece, f"closed before {mark!r}"
        data += piece
    return data


def test_a_streamed_picture_has_the_expected_bytes():
    with streaming() as stream, connect(stream.port) as client:
        head = read_until(client, b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.0 200 OK\r\n")
        assert b"Content-Type: multipart/x-mixed-replace; boundary=skeinframe\r\n" in head
        stream.send_at(0, b"\xff\xd8abc\xff\xd9")
        expected = b"--skeinframe\r\nContent-Type: image/jpeg\r\nContent-Length: 7\r\n\r\n\xff\xd8abc\xff\xd9\r\n"
        assert read_until(client, b"\xff\xd9\r\n") == expected


def test_other_paths_are_not_found():
    with streaming() as stream, connect(stream.port, b"/admin") as client:
        assert read_until(client, b"\r\n").startswith(b"HTTP/1.0 404")


def test_several_clients_and_one_that_never_reads():
    with streaming() as stream:
        slow = connect(stream.port)
        quick = connect(stream.port)
        read_until(quick, b"\r\n\r\n")
        read_until(slow, b"\r\n\r\n")
        big = b"\xff\xd8" + b"x" * 400_000 + b"\xff\xd9"
        for _ in range(30):
            stream.send_at(0, big)
            read_until(quick, b"\xff\xd9\r\n")
        assert stream.frames_sent == 30
        slow.close()
        quick.close()
        wait_for(lambda: stream.clients == 0)


def test_frames_wait_for_their_time_and_keep_its_order():
    with streaming() as stream, connect(stream.port) as client:
        read_until(client, b"\r\n\r\n")
        now_ns = time.monotonic_ns()
        stream.send_at(now_ns + 60_000_000, b"\xff\xd8late\xff\xd9")
        stream.send_at(now_ns + 10_000_000, b"\xff\xd8early\xff\xd9")
        data = read_until(client, b"late")
        assert time.monotonic_ns() >= now_ns + 60_000_000
        assert b"early" in data


def test_a_cut_ends_clients_and_refuses_new_ones_until_it_heals():
    with streaming() as stream:
        client = connect(stream.port)
        read_until(client, b"\r\n\r\n")
        stream.set_accepting(False)
        assert client.recv(100) == b""
        client.close()
        with pytest.raises((AssertionError, ConnectionError)), connect(stream.port) as late:
            read_until(late, b"\r\n\r\n")
        stream.set_accepting(True)
        with connect(stream.port) as client:
            read_until(client, b"\r\n\r\n")


@contextmanager
def reading(port):
    source = open_source(f"http://127.0.0.1:{port}/video.mjpg")
    try:
        yield source
    finally:
        source.close()


def test_the_reader_hands_over_the_newest_frame_only():
    with streaming() as stream, reading(stream.port) as source:
        wait_for(lambda: source.connected)
        for number in range(20):
            stream.send_at(0, JPEG % number)
            wait_for(lambda n=number: source.received == n + 1)
        packet = source.take_newest(1.0)
        assert packet is not None
        assert (packet.data, packet.number) == (JPEG % 19, 20)
        assert 0 <= time.monotonic_ns() - packet.arrival_ns < 5_000_000_000
        assert source.take_newest(0.01) is None


def test_the_reader_comes_back_after_a_cut():
    with streaming() as stream, reading(stream.port) as source:
        wait_for(lambda: source.connected)
        stream.set_accepting(False)
        wait_for(lambda: not source.connected and source.detail)
        stream.set_accepting(True)
        wait_for(lambda: source.connected)
        wait_for(lambda: stream.clients == 1)
        stream.send_at(0, JPEG % 1)
        assert source.take_newest(5.0) is not None


def _serve_once(answer):
    listener = socket.create_server(("127.0.0.1", 0))

    def serve():
        with listener:
            connection, _ = listener.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(answer)

    threading.Thread(target=serve, daemon=True).start()
    return listener.getsockname()[1]


@pytest.mark.parametrize(
    ("answer", "complaint"),
    [
        (b"HTTP/1.0 404 Not Found\r\n\r\n", "404"),
        (b"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n<html>", "no multipart"),
        (b"HTTP/1.1 302 Found\r\nLocation: http://127.0.0.1:81/stream\r\n\r\n", "give http://127.0.0.1:81/stream as"),
        (b"HTTP/1.1 302 Found\r\n\r\n", "'HTTP/1.1 302 Found'"),
        (b"SSH-2.0-OpenSSH\r\n\r\n", "answered"),
        (b"", "no HTTP answer"),
        (b"HTTP/1.0 200 OK\r\nX: " + b"y" * 20000, "no HTTP answer"),
    ],
)
def test_strange_servers_are_named(answer, complaint):
    with reading(_serve_once(answer)) as source:
        wait_for(lambda: complaint in source.detail)
        assert not source.connected


_PART = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n"


@pytest.mark.parametrize("kind", [b"multipart/x-mixed-replace;boundary=frame", b"application/octet-stream"])
def test_a_stream_in_chunks_is_read(kind):
    """As sent by an ESP32: head, picture and boundary each a chunk; ffmpeg calls it a stream of octets."""
    jpeg = JPEG % 1
    chunks = b"".join(b"%x\r\n%s\r\n" % (len(part), part) for part in (_PART % len(jpeg), jpeg, b"\r\n"))
    head = b"HTTP/1.1 200 OK\r\nContent-Type: %s\r\nTransfer-Encoding: chunked\r\n\r\n" % kind
    with reading(_serve_once(head + chunks)) as source:
        packet = source.take_newest(5.0)
        assert packet is not None
        assert packet.data == jpeg
        assert not source.rejected["multipart"]


def test_the_reader_logs_in_with_the_address_s_user_and_password():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        source = open_source(f"http://me:p%40ss@127.0.0.1:{listener.getsockname()[1]}/video.mjpg")
        try:
            listener.settimeout(5.0)
            connection, _ = listener.accept()
            with connection:
                request = read_until(connection, b"\r\n\r\n")
        finally:
            source.close()
    assert request.startswith(b"GET /video.mjpg HTTP/1.0\r\n")
    assert b"\r\nAuthorization: Basic " + b64encode(b"me:p@ss") + b"\r\n" in request


def _answer_in_turn(listener, answers):
    """Answer one connection after the other; returns their requests."""
    requests = []
    listener.settimeout(5.0)
    for answer in answers:
        connection, _ = listener.accept()
        with connection:
            requests.append(read_until(connection, b"\r\n\r\n"))
            connection.sendall(answer)
    return requests


_CHALLENGE = b'HTTP/1.0 401 Unauthorized\r\nWWW-Authenticate: Digest realm="cam", nonce="7", qop="auth"\r\n\r\n'


def test_the_reader_logs_in_by_digest_and_keeps_the_password_to_itself_from_then_on():
    jpeg = JPEG % 1
    head = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n"
    stream = head + _PART % len(jpeg) + jpeg + b"\r\n"
    with socket.create_server(("127.0.0.1", 0)) as listener:
        source = open_source(f"http://me:secret@127.0.0.1:{listener.getsockname()[1]}/video.mjpg?x=1")
        try:
            asked = _answer_in_turn(listener, [_CHALLENGE, stream, _CHALLENGE, stream])
            packet = source.take_newest(5.0)
        finally:
            source.close()
    assert packet is not None and packet.data == jpeg
    assert b"Authorization: Basic" in asked[0]
    assert b"Authorization" not in asked[2]
    for request in (asked[1], asked[3]):
        assert b'Authorization: Digest username="me", realm="cam", nonce="7", uri="/video.mjpg?x=1"' in request
        assert b"secret" not in request and b64encode(b"me:secret") not in request


def test_a_wrong_password_is_told():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        source = open_source(f"http://me:wrong@127.0.0.1:{listener.getsockname()[1]}/video.mjpg")
        try:
            _answer_in_turn(listener, [_CHALLENGE, _CHALLENGE])
            wait_for(lambda: "401" in source.detail)
        finally:
            source.close()


def test_an_absent_camera_is_named():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with reading(port) as source:
        wait_for(lambda: f"127.0.0.1:{port}" in source.detail and "refused" in source.detail)


@pytest.mark.parametrize(
    "url", ["webcam", "ftp://127.0.0.1/x", "http:///nohost", "http://host:port/x", "ardrone://", "rtsp://h ost/x"]
)
def test_unknown_sources_are_refused_at_once(url):
    with pytest.raises(DriverError, match="camera source"):
        open_source(url)

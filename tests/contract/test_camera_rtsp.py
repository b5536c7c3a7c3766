"""The RTSP source against a small server of our own: RTP over the RTSP connection, as RFC 2326 and RFC 6184 have it."""

import base64
import socket
import struct
import threading
import time
from contextlib import contextmanager, suppress
from fractions import Fraction

import av
import numpy as np
from patience import wait_for

from drivers.camera.sources.frames import Packet
from drivers.camera.sources.nal_units import has_parameters
from drivers.camera.sources.opening import open_source


def units_of(data):
    """Return the NAL units of an Annex B access unit."""
    return [part.rstrip(b"\x00") for part in data.split(b"\x00\x00\x01") if part.strip(b"\x00")]


def encoder():
    codec = av.CodecContext.create("libx264", "w")
    codec.width, codec.height, codec.pix_fmt = 160, 96, "yuv420p"
    codec.time_base, codec.framerate = Fraction(1, 25), Fraction(25)
    codec.options = {
        "preset": "ultrafast",
        "tune": "zerolatency",
        "profile": "baseline",
        "x264-params": "keyint=10:scenecut=0:annexb=1:repeat-headers=1",
    }
    return codec


class Camera:
    """Serves one client at a time with 25 pictures a second of rising brightness.

    most: pictures, then none; with_sound: goes on with sound alone; stored: so many pictures at once at first.
    """

    def __init__(self, in_band, most=1 << 20, with_sound=False, stored=0):
        self.in_band, self.most, self.with_sound, self.stored = in_band, most, with_sound, stored
        self.exposed_s = {}
        self.clients = 0
        self.codec, self.number = encoder(), 0
        self.sets = [u for u in units_of(self.picture()) if u[0] & 0x1F in (7, 8)]
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.closing = threading.Event()
        self.connection: socket.socket | None = None
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def picture(self):
        planes = np.full((144, 160), 128, np.uint8)
        planes[:96] = 40 + self.number % 160
        self.number += 1
        (packet,) = self.codec.encode(av.VideoFrame.from_ndarray(planes, "yuv420p"))
        return bytes(packet)

    def serve(self):
        while not self.closing.is_set():
            with suppress(OSError):
                self.connection, _ = self.listener.accept()
                with self.connection:
                    self.talk(self.connection)

    def talk(self, connection):
        self.clients += 1
        while True:
            request = b""
            while b"\r\n\r\n" not in request:
                data = connection.recv(4096)
                if not data:
                    return
                request += data
            method, url = request.decode().split()[:2]
            sequence = next(line for line in request.decode().split("\r\n") if line.lower().startswith("cseq"))
            head, body = f"RTSP/1.0 200 OK\r\n{sequence}\r\nSession: 7\r\n", ""
            if method == "DESCRIBE":
                sets = ",".join(base64.b64encode(u).decode() for u in self.sets)
                body = (
                    "v=0\r\no=- 1 1 IN IP4 127.0.0.1\r\ns=x\r\nc=IN IP4 0.0.0.0\r\nt=0 0\r\na=control:*\r\n"
                    "m=video 0 RTP/AVP 96\r\na=rtpmap:96 H264/90000\r\n"
                    f"a=fmtp:96 packetization-mode=1;sprop-parameter-sets={sets}\r\na=control:track1\r\n"
                )
                if self.with_sound:
                    body += "m=audio 0 RTP/AVP 0\r\na=rtpmap:0 PCMU/8000\r\na=control:track2\r\n"
                head += f"Content-Base: {url}/\r\nContent-Type: application/sdp\r\nContent-Length: {len(body)}\r\n"
            elif method == "SETUP":
                channels = "2-3" if url.endswith("track2") else "0-1"
                head += f"Transport: RTP/AVP/TCP;unicast;interleaved={channels}\r\n"
            connection.sendall(f"{head}\r\n{body}".encode())
            if method == "PLAY":
                self.stream(connection)
                return

    def stream(self, connection):
        sequence = sounds = 0
        began_s, first = time.monotonic(), self.number
        while not self.closing.wait(0.04 * (self.number - first >= self.stored)):
            if self.with_sound:
                rtp = struct.pack(">BBHII", 0x80, 0, sounds & 0xFFFF, sounds * 320, 2) + b"\xff" * 320
                connection.sendall(b"$\x02" + struct.pack(">H", len(rtp)) + rtp)
                sounds += 1
            if self.number > self.most:
                continue
            level = 40 + self.number % 160
            self.exposed_s[level] = min(time.monotonic(), began_s + 0.04 * (self.number - first - self.stored))
            parts = [u for u in units_of(self.picture()) if self.in_band or u[0] & 0x1F not in (7, 8)]
            for index, part in enumerate(parts):
                last = 0x80 if index == len(parts) - 1 else 0
                rtp = struct.pack(">BBHII", 0x80, 96 | last, sequence & 0xFFFF, self.number * 3600, 1) + part
                connection.sendall(b"$\x00" + struct.pack(">H", len(rtp)) + rtp)
                sequence += 1

    def hang_up(self):
        if self.connection is None:
            return
        with suppress(OSError):
            self.connection.shutdown(socket.SHUT_RDWR)

    def close(self):
        self.closing.set()
        self.hang_up()
        with suppress(OSError):
            self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        self.thread.join(5.0)


@contextmanager
def watching(**options):
    camera = Camera(**{"in_band": True, **options})
    source = open_source(f"rtsp://127.0.0.1:{camera.port}/stream")
    try:
        yield camera, source
    finally:
        camera.close()
        source.close()


def taken(source, count, seconds=15.0):
    packets, deadline = list[Packet](), time.monotonic() + seconds
    while len(packets) < count:
        assert time.monotonic() < deadline, (source.detail, source.received, source.rejected)
        packet = source.take_newest(0.1)
        packets += [packet] if packet is not None else []
    return packets


def test_pictures_and_access_units_come_as_they_were_sent():
    with watching(in_band=False) as (_, source):
        packets = taken(source, 25)
        assert source.connected
        assert packets[-1].picture.grey().shape == (96, 160)
        levels = [float(packet.picture.grey().mean()) for packet in packets[-5:]]
        assert levels == sorted(levels) and levels[-1] > levels[0]
        units = source.take_video()
        keys = [unit for unit in units if unit.starts]
        assert keys and all(has_parameters(unit.data) for unit in keys), "a recording can begin at each key picture"
        assert not any(has_parameters(unit.data) for unit in units if not unit.starts)


def test_it_is_read_soon_after_it_is_opened():
    with watching(most=30) as (camera, source):  # a key picture is the 20th
        taken(source, 1)
        assert camera.clients == 1


def test_pictures_that_the_camera_had_stored_are_decoded_but_not_shown():
    """A second of them at once, and each was dated by its arrival."""
    with watching(stored=25) as (camera, source):
        packets = taken(source, 5)
        late_s = [packet.settled_ns / 1e9 - camera.exposed_s[round(packet.picture.grey().mean())] for packet in packets]
        assert max(late_s) < 0.15
        assert source.rejected["held_back"] > 2


def test_it_comes_back_when_the_camera_hangs_up():
    with watching() as (camera, source):
        taken(source, 3)
        camera.hang_up()
        wait_for(lambda: camera.clients == 2)
        taken(source, 3)


def test_it_is_opened_again_when_only_its_sound_goes_on():
    with watching(most=50, with_sound=True) as (camera, source):
        taken(source, 3)
        wait_for(lambda: camera.clients == 2)


def test_an_absent_camera_is_named_without_its_password():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    source = open_source(f"rtsp://user:secret@127.0.0.1:{port}/stream")
    try:
        wait_for(lambda: "refused" in source.detail)
        assert f"127.0.0.1:{port}" in source.detail and "secret" not in source.detail
    finally:
        source.close()

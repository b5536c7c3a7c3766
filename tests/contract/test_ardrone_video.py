"""The emulated drone's video port: bytes decoded by hand, and the driver's reader over loopback."""

import io
import os
import random
import socket
import struct
import time
from collections import Counter
from contextlib import contextmanager

import av
import cv2
import numpy as np
import pytest
from patience import wait_for

from drivers.ardrone.video import Assembly
from drivers.ardrone.wire.configuration import CONFIGURATION
from drivers.ardrone.wire.pave import FrameReader, PaveFrame
from drivers.camera.sources.h264 import H264Decoder
from drivers.camera.sources.opening import open_source
from groundstation.errors import DriverError
from sim_bridge.devices.ardrone_video import ArDroneVideoServer, VideoEncoder, parameter_sizes
from sim_bridge.devices.ardrone_video_mode import VideoMode

MODE_720P = VideoMode(codec=0x83)


def picture(number, size=(640, 360)):
    """Return a structured picture with its number in the brightness of the left half."""
    width, height = size
    rows, columns = np.mgrid[0:height, 0:width]
    pixels = 128 + 60 * np.sin(columns / 9 + number / 3) * np.cos(rows / 7)
    pixels[:, : width // 2] = 30 + 4 * (number % 50)
    return pixels.astype(np.uint8)


def number_of(grey):
    level = float(grey[:, : grey.shape[1] // 4].mean())
    return round(((level - 16) * 255 / 219 - 30) / 4)


def encoded(count, mode=None, fps=15.0, header=68):
    encoder = VideoEncoder(mode or VideoMode(), fps, header)
    size = encoder.mode.size
    return [encoder.encode(picture(k, size), 1000 + k * 66, want_idr=k == 0) for k in range(count)]


@contextmanager
def serving(port=0):
    server = ArDroneVideoServer("127.0.0.1", port)
    try:
        yield server
    finally:
        server.close()


@contextmanager
def reading(port):
    source = open_source(f"ardrone://127.0.0.1:{port}")
    try:
        yield source
    finally:
        source.close()


def receive(client, size):
    data = b""
    while len(data) < size:
        piece = client.recv(65536)
        assert piece, "the drone closed the stream"
        data += piece
    return data


def shown(source, server, pictures, seconds=5.0):
    """Send pictures and return the next decoded one."""
    for one in pictures:
        server.send_at(0, one)
    packet, deadline = None, time.monotonic() + seconds
    while packet is None and time.monotonic() < deadline:
        packet = source.take_newest(0.1)
    return packet


@pytest.mark.parametrize("header", [64, 68])
def test_headers_field_by_field(header):
    stream = encoded(17, header=header)
    position = 0
    for index, one in enumerate(stream):
        data = one.data
        assert data[:6] == b"PaVE\x02\x04"
        header_size, payload_size = struct.unpack_from("<HI", data, 6)
        assert (header_size, payload_size) == (header, len(data) - header)
        assert struct.unpack_from("<4H", data, 12) == (640, 368, 640, 360)
        assert struct.unpack_from("<II", data, 20) == (index + 1, 1000 + index * 66)
        assert data[28:32] == bytes([1, 0, 1 if index % 15 == 0 else 3, 0])
        assert struct.unpack_from("<Q", data, 32) == (position,)
        assert struct.unpack_from("<H", data, 40) == (1,)
        assert data[42:44] == b"\x01\x00"
        assert struct.unpack_from("<I", data, 48) == (payload_size,)
        position += len(data)
        kinds = {0: b"\x67", 1: b"\x61"}
        assert data[header : header + 4] == b"\x00\x00\x00\x01"
        unit = data[header + 4 :]
        assert unit[:1] == kinds[0] if one.is_idr else unit[0] & 0x1F == 1
    sps, pps = stream[0].data[44:46]
    behind = stream[0].data[header + sps :]
    assert behind[:4] == b"\x00\x00\x00\x01" and behind[4] & 0x1F == 8
    after = behind[pps:]
    assert after.lstrip(b"\x00")[:1] == b"\x01" and after.lstrip(b"\x00")[1] & 0x1F == 5
    assert parameter_sizes(b"\x00\x00\x00\x01\x67ab") == (0, 0)


def test_sizes_are_those_of_a_real_drone():
    """WIRE: IDRs of 12 to 19 kB, others of 2 to 5 kB, 1000 kbit/s at 30 pictures a second."""
    sizes = [len(one.data) for one in encoded(45, fps=30.0)]
    assert 100_000 < 8 * sum(sizes) / 1.5 < 1_300_000
    assert max(sizes) < 20_000


@pytest.mark.parametrize("mode", [VideoMode(), MODE_720P])
def test_ffmpeg_reads_the_payloads_as_a_file(mode):
    stream = b"".join(one.data[68:] for one in encoded(8, mode))
    with av.open(io.BytesIO(stream), "r", format="h264") as container:
        frames = list(container.decode(video=0))
    assert [(frame.width, frame.height) for frame in frames] == [mode.size] * 8


def test_the_configuration_chooses_size_camera_and_rate():
    values = {name: key.default for name, key in CONFIGURATION.items() if isinstance(key.default, int)}
    assert VideoMode.configured(values.__getitem__) == VideoMode()
    values |= {"video:video_codec": 131, "video:video_channel": 1, "video:max_bitrate": 4000}
    mode = VideoMode.configured(values.__getitem__)
    assert (mode.size, mode.bottom, mode.stream) == ((1280, 720), True, 2)
    assert mode.bits_per_picture == pytest.approx(4_000_000 / 30)


@pytest.mark.parametrize("header", [64, 68])
def test_the_driver_receives_each_rendered_picture_once_and_in_order(header):
    with serving() as server, reading(server.port) as source:
        wait_for(lambda: server.clients == 1 and source.connected)
        for index, one in enumerate(encoded(20, header=header)):
            packet = shown(source, server, [one])
            assert packet is not None and packet.picture.grey().shape == (360, 640)
            assert number_of(packet.picture.grey()) == index
            assert (packet.data, packet.number) == (b"", index + 1)
            (unit,) = source.take_video()
            assert unit.data == one.data[header:] and unit.starts == one.is_idr
        colours = cv2.imdecode(np.frombuffer(packet.picture.jpeg(), np.uint8), cv2.IMREAD_COLOR)
        assert colours is not None and colours.shape == (360, 640, 3)
        assert not +source.rejected


def test_after_a_stall_only_the_newest_picture_is_shown():
    stream = encoded(45)
    with serving() as server, reading(server.port) as source:
        wait_for(lambda: server.clients == 1)
        assert shown(source, server, stream[:1]) is not None
        for one in stream[1:]:
            server.send_at(0, one)
        wait_for(lambda: source.received == 45)
        packet = source.take_newest(1.0)
        assert packet is not None and number_of(packet.picture.grey()) == 44 and packet.number == 45
        assert source.take_newest(0.01) is None
        assert [unit.data for unit in source.take_video()] == [one.data[68:] for one in stream]


def test_a_client_that_comes_late_begins_at_an_idr():
    stream = encoded(20)
    with serving() as server:
        assert not server.take_newcomers()
        with reading(server.port) as source:
            wait_for(lambda: server.clients == 1)
            assert server.take_newcomers() and not server.take_newcomers()
            assert shown(source, server, stream[3:15], seconds=0.3) is None
            assert source.received == 0
            packet = shown(source, server, stream[15:16])
            assert packet is not None and number_of(packet.picture.grey()) == 15


def test_a_slow_client_misses_pictures_up_to_an_idr_and_holds_up_nobody():
    stream = encoded(60)
    with serving() as server:
        slow = socket.socket()
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.connect(("127.0.0.1", server.port))
        with slow, reading(server.port) as source:
            wait_for(lambda: server.clients == 2)
            for round_ in range(12):
                assert shown(source, server, stream) is not None, round_
                wait_for(lambda n=round_: source.received == (n + 1) * len(stream))
            slow.settimeout(0.5)
            reader, frames = FrameReader(), list[PaveFrame]()
            try:
                while len(frames) < 600 and (data := slow.recv(1 << 16)):
                    frames += reader.feed(data)
            except TimeoutError:
                pass
            assert 0 < len(frames) < 700 and reader.skipped == 0
            last = frames[0]
            for frame in frames[1:]:
                assert frame.number == last.number + 1 or frame.kind == 1
                last = frame


def test_a_new_picture_size_comes_through():
    with serving() as server, reading(server.port) as source:
        wait_for(lambda: server.clients == 1)
        small = VideoEncoder(VideoMode(), 15.0, 68)
        packet = shown(source, server, [small.encode(picture(1), 0, want_idr=True)])
        assert packet is not None and packet.picture.grey().shape == (360, 640)
        large = VideoEncoder(MODE_720P, 15.0, 68, small.number, small.position)
        packet = shown(source, server, [large.encode(picture(2, (1280, 720)), 66, want_idr=False)])
        assert packet is not None and packet.picture.grey().shape == (720, 1280)


def test_it_comes_back_after_a_cut_and_waits_for_an_idr():
    stream = encoded(31)
    with serving() as server, reading(server.port) as source:
        wait_for(lambda: server.clients == 1)
        assert shown(source, server, stream[:1]) is not None
        server.set_accepting(False)
        wait_for(lambda: not source.connected and "closed" in source.detail)
        server.set_accepting(True)
        wait_for(lambda: source.connected and server.clients == 1)
        assert shown(source, server, stream[3:6], seconds=0.2) is None
        for expected, one in enumerate(stream[15:17], 15):
            packet = shown(source, server, [one])
            assert packet is not None and number_of(packet.picture.grey()) == expected


def test_a_drone_without_video_is_named():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with reading(port) as source:
        wait_for(lambda: "refused" in source.detail)
        assert f"127.0.0.1:{port}" in source.detail and "AR.Drone 1" in source.detail


def test_damage_on_the_way_costs_pictures_but_never_the_reader():
    stream = b"".join(one.data for one in encoded(30))
    fuzzed(stream, rounds=60, seed=5)


@pytest.mark.slow
@pytest.mark.fuzz
def test_much_damage_on_the_way_costs_pictures_but_never_the_reader():
    stream = b"".join(one.data for one in encoded(30))
    fuzzed(stream, rounds=1500, seed=int(os.environ.get("FUZZ_SEED", "6")))


def fuzzed(stream, rounds, seed):
    """Cut, flip and repeat parts of a stream; every decoded picture has a size of the stream's."""
    rng = random.Random(seed)
    decoded = 0
    for _ in range(rounds):
        data = bytearray(stream)
        for _ in range(rng.randrange(1, 12)):
            place = rng.randrange(len(data))
            kind = rng.randrange(4)
            if kind == 0:
                data[place] ^= 1 << rng.randrange(8)
            elif kind == 1:
                del data[place : place + rng.randrange(1, 3000)]
            elif kind == 2:
                data[place:place] = rng.randbytes(rng.randrange(1, 200))
            else:
                header = data.find(b"PaVE", place)
                if header >= 0 and header + 64 < len(data):
                    data[header + rng.randrange(4, 64)] = rng.randrange(256)
        reader, assembly, decoder = FrameReader(), Assembly(), H264Decoder(Counter())
        for start in range(0, len(data), 20_000):
            try:
                units = assembly.units(reader.feed(bytes(data[start : start + 20_000])), start)
            except DriverError:
                assembly = Assembly()
                continue
            found = decoder.newest(units) if units else None
            if found is not None:
                decoded += 1
                height, width = found[1].grey().shape
                assert 0 < width <= 4096 and 0 < height <= 4096
    assert decoded > rounds

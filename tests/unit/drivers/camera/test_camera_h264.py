"""From access units to pictures: backlogs, gaps, damage, another size, and a real drone's recording."""

from collections import Counter
from fractions import Fraction

import av
import numpy as np
import pytest

from drivers.ardrone.video import Assembly
from drivers.ardrone.wire.pave import FrameReader, FrameType, PaveFrame
from drivers.camera.sources.frames import Unit
from drivers.camera.sources.h264 import H264Decoder, VideoPicture
from drivers.camera.sources.jitter_filter import SenderClock
from groundstation.errors import DriverError

MS = 1_000_000


def encoded(count, size=(160, 96), period=10):
    """Return (bytes, is key) of pictures whose brightness is 20 + 5 x number."""
    codec = av.CodecContext.create("libx264", "w")
    (codec.width, codec.height), codec.pix_fmt = size, "yuv420p"
    codec.time_base, codec.framerate = Fraction(1, 15), Fraction(15)
    codec.options = {
        "preset": "ultrafast",
        "tune": "zerolatency",
        "profile": "baseline",
        "x264-params": f"keyint={period}:scenecut=0:annexb=1:repeat-headers=1",
    }
    packets = []
    for number in range(count):
        planes = np.full((size[1] * 3 // 2, size[0]), 128, np.uint8)
        planes[: size[1]] = 20 + 5 * number
        packets += [(bytes(p), p.is_keyframe) for p in codec.encode(av.VideoFrame.from_ndarray(planes, "yuv420p"))]
    return packets


def units(packets, first=True):
    return [Unit(data, 0, 0, key, first or index > 0) for index, (data, key) in enumerate(packets)]


def brightness(found):
    return None if found is None else round((float(found[1].grey().mean()) - 20) / 5)


@pytest.fixture(scope="module")
def stream():
    return encoded(25)


def test_each_picture_comes_out_at_once(stream):
    decoder = H264Decoder(Counter())
    assert [brightness(decoder.newest([unit])) for unit in units(stream)] == list(range(25))


def test_a_backlog_is_decoded_from_its_newest_key_picture_on(stream, monkeypatch):
    decoder, decoded = H264Decoder(Counter()), []
    monkeypatch.setattr(decoder, "_decode", lambda unit: decoded.append(unit))
    decoder.newest(units(stream))
    assert len(decoded) == 5
    assert brightness(H264Decoder(Counter()).newest(units(stream))) == 24


def test_nothing_is_shown_before_a_key_picture_nor_across_a_gap(stream):
    decoder = H264Decoder(Counter())
    assert decoder.newest(units(stream[3:6])) is None
    assert brightness(decoder.newest(units(stream[10:13]))) == 12
    assert decoder.newest(units(stream[15:19], first=False)) is None
    assert brightness(decoder.newest(units(stream[20:]))) == 24
    assert decoder.rejected["before_key_picture"] == 7


def test_a_damaged_picture_costs_those_up_to_the_next_key_picture(stream):
    decoder = H264Decoder(Counter())
    decoder.newest(units(stream[:3]))
    damaged = [(stream[3][0][:8] + b"\xaa" * 40, False), *stream[4:9]]
    assert decoder.newest(units(damaged)) is None
    assert decoder.rejected["h264"] == 1
    assert brightness(decoder.newest(units(stream[10:12]))) == 11


def test_a_lost_picture_costs_those_up_to_the_next_key_picture(stream):
    decoder = H264Decoder(Counter())
    assert brightness(decoder.newest(units(stream[:3]))) == 2
    for index in range(4, 10):
        assert decoder.newest(units([stream[index]])) is None, "it refers to the lost one"
    assert brightness(decoder.newest(units([stream[10]]))) == 10
    assert decoder.rejected == {"after_lost_picture": 1, "before_key_picture": 5}


def test_another_picture_size_begins_with_its_key_picture(stream):
    decoder = H264Decoder(Counter())
    decoder.newest(units(stream[:5]))
    found = decoder.newest(units(encoded(2, (320, 192))))
    assert found is not None and found[1].grey().shape == (192, 320)
    assert found[1].jpeg().startswith(b"\xff\xd8")


@pytest.mark.parametrize("form", ["gray", "yuv420p", "nv12", "gray10le", "gray16le", "yuv420p10le", "yuv422p10le"])
def test_brightness_is_read_whatever_the_bits_of_a_sample(form):
    grey = np.add.outer(np.arange(96), np.arange(160)).astype(np.uint8) // 2 + 30
    frame = av.VideoFrame.from_ndarray(grey, format="gray").reformat(format=form)
    shown = VideoPicture(frame).grey()
    assert shown.shape == grey.shape
    assert np.abs(shown.astype(int) - grey).max() <= 16, "at most the difference of limited and full range"


def test_pictures_of_a_real_drone(real_data):
    assembly, decoder = Assembly(), H264Decoder(Counter())
    shapes, sharpness = [], []
    for frame in FrameReader().feed(real_data("ardrone/pave68-node-24971.bin").read_bytes()):
        found = decoder.newest(assembly.units([frame], frame.timestamp_ms * MS + 77))
        assert found is not None
        shapes.append(found[1].grey().shape)
        sharpness.append(float(found[1].grey().std()))
    assert shapes == [(360, 640)] * 5
    assert min(sharpness) > 15 and not decoder.rejected


def pave(number, payload=b"x", timestamp_ms=0, kind=FrameType.PREDICTED, codec=4, **more):
    return PaveFrame(codec, 640, 360, number, timestamp_ms, kind, payload, **more)


def test_gaps_and_new_sizes_are_seen_by_number_and_header():
    assembly = Assembly()
    frames = [
        pave(1, kind=FrameType.IDR),
        pave(2),
        pave(4),
        pave(5),
        PaveFrame(4, 1280, 720, 6, 0, FrameType.PREDICTED, b"x"),
    ]
    got = [unit for frame in frames for unit in assembly.units([frame], 0)]
    assert [(unit.starts, unit.follows) for unit in got] == [
        (True, False),
        (False, True),
        (False, False),
        (False, True),
        (False, False),
    ]


def test_slices_are_joined_and_a_missing_one_is_a_gap():
    assembly = Assembly()
    first = [pave(1, b"a", kind=FrameType.IDR, slices=2), pave(1, b"b", kind=FrameType.IDR, slices=2, slice_index=1)]
    (unit,) = assembly.units(first, 0)
    assert (unit.data, unit.starts) == (b"ab", True)
    (torn,) = assembly.units([pave(2, b"d", slices=2, slice_index=1)], 0)
    assert not torn.follows
    (after,) = assembly.units([pave(3, b"e")], 0)
    assert not after.follows


@pytest.mark.parametrize(("codec", "named"), [(2, "P264"), (1, "VLIB"), (3, "MPEG-4"), (9, "codec 9")])
def test_other_codecs_are_named(codec, named):
    with pytest.raises(DriverError, match=named):
        Assembly().units([pave(1, codec=codec)], 0)


def test_jitter_and_late_frames_do_not_move_the_exposure():
    random = np.random.default_rng(1)
    clock, wrong_ms = SenderClock(), []
    for index in range(300):
        exposed = 1000 + index * 66
        late = 200 * (random.random() < 0.05)
        arrival = exposed + 120 + float(random.uniform(-20, 20)) + late + 55_000
        (settled,) = clock.settle([exposed * MS], round(arrival * MS))
        if index > 30:
            wrong_ms.append(settled / MS - 55_000 - exposed - 120)
    assert np.max(np.abs(wrong_ms)) < 8
    assert np.std(wrong_ms) < 3


def test_frames_that_waited_together_say_nothing_of_the_delay_but_the_last():
    clock = SenderClock()
    for index in range(10):
        clock.settle([index * 66 * MS], (index * 66 + 100) * MS)
    settled = clock.settle([660 * MS, 726 * MS, 792 * MS], (792 + 100) * MS)
    assert settled == [760 * MS, 826 * MS, 892 * MS]


def test_a_clock_that_is_put_forward_a_little_is_learnt_anew_at_once():
    """By two seconds, as in a camera with network time: its pictures were stamped by their arrival."""
    clock = SenderClock()
    for index in range(100):
        clock.settle([index * 66 * MS], (index * 66 + 100) * MS)
    late = [clock.settle([(index * 66 + 2000) * MS], (index * 66 + 100 + extra) * MS)[0] - index * 66 * MS
            for index, extra in zip(range(100, 106), (0, 0, 60, 0, 0, 60), strict=True)]  # fmt: skip
    assert late == [100 * MS] * 6, "free of the network's jitter again"


def test_a_clock_that_jumps_or_stands_still_is_not_believed():
    clock = SenderClock()
    clock.settle([5000 * MS], 100_000 * MS)
    assert clock.settle([100 * MS], 100_066 * MS) == [100_066 * MS]
    assert clock.settle([100 * MS], 100_132 * MS) == [100_132 * MS]
    assert clock.settle([90_000 * MS], 100_200 * MS) == [100_200 * MS]


@pytest.mark.parametrize(("rate", "numbered_for"), [(24, 25), (14.8, 15), (12.5, 25), (30, 25)])
def test_stamps_by_a_rate_that_the_camera_does_not_keep_are_not_believed(rate, numbered_for):
    """As of cameras that halve their rate in the dark."""
    random, clock, wrong_ms = np.random.default_rng(1), SenderClock(), []
    for index in range(600):
        usual_ms = index / rate * 1000 + 120
        arrival_ms = usual_ms + float(random.uniform(-8, 8))
        (settled,) = clock.settle([round(index / numbered_for * 1000 * MS)], round(arrival_ms * MS))
        wrong_ms.append(settled / MS - usual_ms)
    assert np.max(np.abs(wrong_ms[30:])) < 16, "twice the jitter"


@pytest.mark.parametrize("rate", [15, 60, 120])
@pytest.mark.parametrize("stall_ms", [1000, 1900])
def test_pictures_that_waited_for_a_stall_say_nothing_of_the_delay(rate, stall_ms):
    clock, wrong_ms = SenderClock(), []
    for index in range(rate * 12):
        exposed_ms = 1000 * index / rate
        is_held = 6000 <= exposed_ms + 120 < 6000 + stall_ms
        arrival_ms = 6000 + stall_ms if is_held else exposed_ms + 120
        (settled,) = clock.settle([round(exposed_ms * MS)], round(arrival_ms * MS))
        wrong_ms.append(settled / MS - exposed_ms - 120)
    assert np.max(np.abs(wrong_ms)) < 1

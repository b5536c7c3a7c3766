"""Numbers of H.264 pictures: sound streams of all kinds have no gap, and each lost reference is one."""

from fractions import Fraction

import av
import numpy as np
import pytest

from drivers.ardrone.wire.pave import FrameReader
from drivers.camera.sources.nal_units import unit_heads
from drivers.camera.sources.picture_numbers import PictureNumbers

KINDS = {
    "as drones send": {"tune": "zerolatency", "profile": "baseline"},
    "B-frames that are references": {"preset": "medium", "x264-params": "bframes=3:b-pyramid=normal:keyint=30"},
    "open groups": {"preset": "medium", "x264-params": "bframes=3:open-gop=1:keyint=12:min-keyint=12"},
    "interlaced": {"preset": "veryfast", "x264-params": "interlaced=1:bframes=2:keyint=30"},
    "several slices": {"tune": "zerolatency", "x264-params": "slices=4"},
    "many references": {"preset": "veryslow", "x264-params": "ref=16:keyint=250"},
    "intra refresh": {"tune": "zerolatency", "x264-params": "intra-refresh=1:keyint=20"},
    "scaling lists": {"preset": "veryfast", "x264-params": "cqm=jvt:8x8dct=1:bframes=0"},
}


def encoded(options, count=70, form="yuv420p"):
    codec = av.CodecContext.create("libx264", "w")
    codec.width, codec.height, codec.pix_fmt = 160, 96, form
    codec.time_base, codec.framerate, codec.gop_size = Fraction(1, 25), Fraction(25), 20
    codec.options = options
    noise = np.random.default_rng(1).integers(0, 255, (96, 400), dtype=np.uint8)
    units = []
    for number in range(count):
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(noise[:, 3 * number : 3 * number + 160]), "gray")
        frame = frame.reformat(format=form)
        frame.pts = number
        units += [bytes(packet) for packet in codec.encode(frame)]
    return units + [bytes(packet) for packet in codec.encode(None)]


def is_reference(unit):
    """Whether it is a picture to which others refer, and no key picture."""
    heads = [head[0] for head in unit_heads(unit, 1)]
    return any(head & 0x1F == 1 and head & 0x60 for head in heads) and not any(head & 0x1F == 5 for head in heads)


@pytest.mark.parametrize("kind", KINDS)
def test_a_sound_stream_has_no_gap_and_each_lost_reference_is_one(kind):
    units = encoded(KINDS[kind])
    assert len(units) == 70
    numbers = PictureNumbers()
    assert all(numbers.follows(unit) for unit in units)
    lost = [index for index in range(1, 50) if is_reference(units[index])]
    assert len(lost) > 8
    for index in lost:
        numbers = PictureNumbers()
        following = next(at for at in range(index + 1, 70) if is_reference(units[at]) or b"\x01\x65" in units[at])
        seen = [numbers.follows(unit) for at, unit in enumerate(units[: following + 1]) if at != index]
        assert all(seen[:index])
        assert b"\x01\x65" in units[following] or not all(seen), "noticed by the next reference at the latest"


@pytest.mark.parametrize("form", ["yuv444p", "yuv422p", "yuv420p10le"])
def test_other_formats_of_colour_are_read(form):
    units = encoded({"tune": "zerolatency"}, 12, form)
    numbers = PictureNumbers()
    assert all(numbers.follows(unit) for unit in units[:6])
    assert not numbers.follows(units[7])


def test_units_without_parameters_or_with_unreadable_ones_are_trusted():
    units = encoded(KINDS["as drones send"], 12)
    assert all(PictureNumbers().follows(unit) for unit in units[1:])
    for broken in (b"\0\0\1\x67", b"\0\0\1\x67\x42\x00\x1e\x00\x00\x00\x00\x00", b"\0\0\1\x67" + b"\xff" * 600):
        numbers = PictureNumbers()
        assert numbers.follows(units[0]) and numbers.follows(broken)
        assert numbers.follows(units[5])


def bits(text, size):
    return int(text.replace(" ", "").ljust(8 * size, "0"), 2).to_bytes(size)


@pytest.mark.parametrize("may_be_left_out", [True, False])
def test_numbers_may_be_left_out_where_the_parameters_say_so(may_be_left_out):
    """Assembled by hand (H.264, 7.3): baseline, numbers of 4 bits, order of kind 2, one reference."""
    sequence = bits(f"01000010 00000000 00011110 1 1 011 010 {may_be_left_out:d} 1", 6)
    key, later = bits("1 011 1 0000", 3), bits("1 1 1 0101", 3)
    numbers = PictureNumbers()
    assert numbers.follows(b"\0\0\1\x67" + sequence + b"\0\0\1\x68" + bits("1 1", 1) + b"\0\0\1\x65" + key)
    assert numbers.follows(b"\0\0\1\x41" + later) is may_be_left_out


def test_the_pictures_of_a_real_drone_follow_each_other(real_data):
    frames = FrameReader().feed(real_data("ardrone/pave68-node-24971.bin").read_bytes())
    numbers = PictureNumbers()
    assert [numbers.follows(frame.payload) for frame in frames] == [True] * 5

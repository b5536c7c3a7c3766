"""Frames of a serial line behind bytes that only look like the beginning of one."""

import pytest

from drivers.mavlink.links.stream_cutter import StreamCutter
from drivers.mavlink.wire.frames import FrameEncoder
from drivers.mavlink.wire.telemetry import Heartbeat, Statustext

FALSE_START = b"\xfd\xff\x00"
BEATS = [FrameEncoder(1, 1).encode(Heartbeat(2, 3, 1, number, 3)) for number in range(15)]
OLD = FrameEncoder(1, 1).encode(Heartbeat(2, 3, 1, 4, 3), old=True)


def heard_of(cutter, *parts):
    """Return the right frames that each part completes."""
    return [[frame for frame in cutter.feed(part) if frame in (*BEATS, OLD)] for part in parts]


def test_a_false_start_swallows_no_frame_and_delays_none():
    assert heard_of(StreamCutter(), FALSE_START, *BEATS) == [[], *([beat] for beat in BEATS)]


def test_between_frames_it_delays_the_next_until_another_follows():
    heard = heard_of(StreamCutter(), BEATS[0], FALSE_START, *BEATS[1:])
    assert heard == [[BEATS[0]], [], [], [BEATS[1], BEATS[2]], *([beat] for beat in BEATS[3:])]


@pytest.mark.parametrize("step", [1, 5, 64])
def test_a_cut_frame_costs_itself_alone(step):
    stream = BEATS[0] + BEATS[1][:12] + BEATS[2] + BEATS[3] + BEATS[4][3:] + b"".join(BEATS[5:])
    parts = [stream[begin : begin + step] for begin in range(0, len(stream), step)]
    heard = [frame for part in heard_of(StreamCutter(), *parts) for frame in part]
    assert heard == [BEATS[0], BEATS[2], BEATS[3], *BEATS[5:]]


def test_a_frame_within_a_frame_is_not_cut_out_of_it():
    outer = FrameEncoder(1, 1).encode(Statustext(6, "x" * 50, 0, 0)).replace(b"x" * len(BEATS[0]), BEATS[0], 1)
    outer = outer[:-2] + sum_of(outer)
    cutter = StreamCutter()
    assert cutter.feed(BEATS[1] + outer[:-1]) == [BEATS[1]] and cutter.feed(outer[-1:]) == [outer]


def sum_of(frame):
    from pymavlink.dialects.v20 import all as widest

    extra = widest.mavlink_map[int.from_bytes(frame[7:10], "little")].crc_extra
    return widest.x25crc(frame[1:-2] + bytes([extra])).crc.to_bytes(2, "little")


def test_frames_of_version_1_are_found_and_false_starts_of_them_are_not():
    cutter = StreamCutter()
    assert heard_of(cutter, b"\xfe\x09", BEATS[0], OLD, BEATS[1]) == [[], [BEATS[0]], [OLD], [BEATS[1]]]

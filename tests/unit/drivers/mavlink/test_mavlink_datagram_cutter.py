"""Frames in datagrams that break them anywhere: none is lost, none is made of two senders' bytes, memory is bounded."""

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.mavlink.links import datagram_cutter
from drivers.mavlink.links.datagram_cutter import DatagramCutter
from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.frames import FrameEncoder
from groundstation.time_units import NS_PER_S

BRIDGE, OTHER = ("10.0.0.2", 14550), ("10.0.0.3", 14550)
MESSAGES = [
    message
    for at in range(3)
    for message in (
        t.Heartbeat(2, 12, 0x51, 0xFDFD, 4),
        t.HighresImu(at, 0.1, 0.2, -9.8, 0.01, 0.02, 0.03, 0.2, 0.1, 0.4, 1013.0, 0.1, 1.0, 30.0),
        t.AttitudeQuaternion(at, 1.0, 0.1, 0.1, 0.1, 0.01, 0.01, 0.01),
        t.LocalPositionNed(at, 1.0, 2.0, -1.0, 0.1, 0.1, 0.1),
        t.RawImu(at, -2, -3, -1000, 1, 2, 3),
        t.Statustext(4, "a text"),
    )
]
FRAMES = [FrameEncoder(1, 1).encode(message) for message in MESSAGES]
STREAM = b"".join(FRAMES)
OLD = [FrameEncoder(1, 1).encode(message, old=True) for message in MESSAGES]


class Cut:
    """A cutter with its counts; `take` gives it datagrams of one source, 20 ms apart."""

    def __init__(self) -> None:
        self.rejected: Counter[str] = Counter()
        self.cutter = DatagramCutter(lambda reason, _: self.rejected.update([reason]))
        self.now_ns = NS_PER_S

    def take(self, *datagrams: bytes, source=BRIDGE) -> list[bytes]:
        found = []
        for datagram in datagrams:
            self.now_ns += NS_PER_S // 50
            found += self.cutter.take(self.now_ns, datagram, source)
        return found


def pieces(data: bytes, size: int) -> list[bytes]:
    return [data[at : at + size] for at in range(0, len(data), size)]


@pytest.mark.parametrize("size", [1, 2, 3, 20, 64, 128, 240, 1024])
@pytest.mark.parametrize("frames", [FRAMES, OLD, [one for pair in zip(FRAMES, OLD, strict=False) for one in pair]])
def test_no_frame_is_lost_wherever_a_bridge_cuts(size, frames) -> None:
    cut = Cut()
    assert cut.take(*pieces(b"".join(frames), size)) == frames
    assert not cut.rejected


def test_a_link_opened_in_the_midst_of_a_stream_finds_its_frames() -> None:
    cut = Cut()
    assert cut.take(*pieces(STREAM[7:], 100)) == FRAMES[1:]
    assert cut.rejected == {"no_frame": 1}


@pytest.mark.parametrize("lost", range(1, 8))
def test_a_lost_datagram_costs_only_the_frames_that_it_had_bytes_of(lost) -> None:
    size, ends = 100, [len(b"".join(FRAMES[: n + 1])) for n in range(len(FRAMES))]
    datagrams = pieces(STREAM, size)
    found = Cut().take(*datagrams[:lost], *datagrams[lost + 1 :])
    first, last = lost * size, (lost + 1) * size
    kept = [f for f, end in zip(FRAMES, ends, strict=True) if end <= first or end - len(f) >= last]
    assert [one for one in found if one in FRAMES] == kept


def test_bytes_that_are_no_frame_are_counted_and_the_frames_behind_them_found() -> None:
    cut = Cut()
    assert cut.take(FRAMES[0] + b"\x00\xfd\x03noise\xfe" + FRAMES[1] + b"\x55" + FRAMES[2]) == FRAMES[:3]
    assert cut.rejected == {"no_frame": 2}
    assert cut.take(b"\xfd\x01\x02" + bytes(12) + FRAMES[3]) == [FRAMES[3]]
    assert cut.rejected == {"no_frame": 2, "incompatible": 1}


def test_another_source_completes_no_frame() -> None:
    cut = Cut()
    assert cut.take(FRAMES[0][:10]) == []
    assert cut.take(FRAMES[0][10:], source=OTHER) == cut.take(FRAMES[0][10:], source=(BRIDGE[0], 14551)) == []
    assert cut.take(FRAMES[0][10:]) == [FRAMES[0]]


def test_a_beginning_without_end_hides_no_frame_that_comes_whole() -> None:
    cut = Cut()
    for begun in (b"\xfd", b"\xfd\xff\x00", FRAMES[1][:-1], b"\xfe\xff"):
        assert cut.take(begun, b"", FRAMES[0]) == [FRAMES[0]]
    assert cut.rejected == {"truncated": 4}
    assert cut.take(b"\xfd\xff\x00", b"\x01" * 10 + FRAMES[0], bytes(300), FRAMES[2]) == [FRAMES[0], FRAMES[2]]


def test_an_unfinished_frame_is_forgotten_after_a_second() -> None:
    cut = Cut()
    cut.take(FRAMES[0][:10])
    cut.now_ns += NS_PER_S
    assert cut.take(FRAMES[0][10:]) == [] and cut.rejected["truncated"] == 1
    assert cut.take(FRAMES[1]) == [FRAMES[1]]


def test_unfinished_frames_are_kept_of_64_sources() -> None:
    cut = Cut()
    for port in range(1, 66):
        cut.cutter.take(cut.now_ns, FRAMES[0][:10], (BRIDGE[0], port))
    assert cut.rejected == {"truncated": 1}
    found = [cut.cutter.take(cut.now_ns, FRAMES[0][10:], (BRIDGE[0], port)) for port in range(65, 0, -1)]
    assert found == [[FRAMES[0]]] * 64 + [[]]


@pytest.mark.parametrize(
    "seed", [b"\xfd\x05\x00", b"\xfd", b"\xfe\x05", b"\x00\xfd\x20\x00\x00\x00\x01\x01\x00\x00\x00"]
)
def test_a_datagram_of_false_beginnings_costs_no_more_than_one_of_frames(seed, monkeypatch) -> None:
    checks: Counter[str] = Counter()
    for name in ("frame_size", "is_whole"):
        called = getattr(datagram_cutter, name)

        def counted(*given, name=name, called=called):
            checks[name] += 1
            return called(*given)

        monkeypatch.setattr(datagram_cutter, name, counted)
    cut = Cut()
    cut.take(b"\x00" + (seed * 2048)[:2040])
    assert checks["is_whole"] <= 33 and checks["frame_size"] <= 200
    assert cut.take(*[(seed * 2048)[:2048]] * 20, bytes(300), FRAMES[0])[-1] == FRAMES[0]


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.binary(max_size=300) | st.sampled_from([*FRAMES, FRAMES[0][:9], FRAMES[1][5:], OLD[0]]), max_size=12)
)
def test_any_bytes_raise_nothing_and_keep_less_than_a_frame(datagrams) -> None:
    cut = Cut()
    cut.take(*datagrams)
    assert all(len(begun) < 280 for _, begun in cut.cutter._begun.values())

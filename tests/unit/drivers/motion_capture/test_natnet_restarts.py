"""The NatNet client with a system that is restarted or changed while it streams: names, and where frames are taken."""

import socket
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import pytest
from free_port import free_port

from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.settings import parse_source
from drivers.motion_capture.sources import NatnetSource
from drivers.motion_capture.wire import natnet

HOST, GROUP, MS = "127.0.0.1", "239.255.42.99", 1_000_000
PLACES = {"cf1": (1.0, 0.0, 1.0), "cf2": (2.0, 0.0, 1.0)}
TICKS_PER_S = 1000


class Motive:
    """A system at 100 Hz and its client, both on a manual clock. gone: it is switched off."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_ns, self.ids, self.gone, self.number = 10**12, {"cf1": 1, "cf2": 2}, False, 0
        monkeypatch.setattr("groundstation.bus.clock.now_ns", lambda: self.now_ns)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HOST, 0))
        self.socket.setblocking(False)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(HOST))
        self.ports = [free_port(HOST, kind=socket.SOCK_DGRAM) for _ in range(2)]
        self.server = natnet.Server("Motive", (4, 1), TICKS_PER_S, self.ports[0], "")
        self.client: tuple[str, int] | None = None
        self.started_ns, self.data_port_only = 0, False
        self.source = NatnetSource(parse_source(f"natnet://{HOST}:{self.socket.getsockname()[1]}"))

    def answer(self) -> None:
        with suppress(BlockingIOError):
            while True:
                datagram, sender = self.socket.recvfrom(2048)
                kind, _ = natnet.message_of(datagram)
                if self.gone:
                    continue
                if kind == natnet.CONNECT:
                    self.client = sender
                    self.socket.sendto(natnet.encode_server(self.server), sender)
                elif kind == natnet.REQUEST_DESCRIPTIONS:
                    names = {number: name for name, number in self.ids.items()}
                    self.socket.sendto(natnet.encode_descriptions(names, self.server.version), sender)

    def frame(self, changed: bool = False) -> bytes:
        self.number += 1
        bodies = tuple(
            natnet.Body(self.ids[name], place, (0.0, 0.0, 0.0, 1.0))
            for name, place in PLACES.items()
            if name in self.ids
        )
        ticks = (self.now_ns - self.started_ns) // MS
        return natnet.encode_frame(
            natnet.Frame(self.number, bodies, ticks - 5, ticks, changed=changed), self.server.version
        )

    def send(self, datagram: bytes) -> None:
        to = self.client
        if self.server.group or self.data_port_only:
            to = (self.server.group or HOST, self.server.data_port)
        if to is not None and not self.gone:
            self.socket.sendto(datagram, to)

    def run(self, frames: int, changed: bool = False) -> list[CapturedFrame]:
        came = []
        for _ in range(frames):
            self.now_ns += 10 * MS
            self.answer()
            self.send(self.frame(changed))
            came += self.source.poll(0.0)
        return came


@pytest.fixture
def motive(monkeypatch: pytest.MonkeyPatch) -> Iterator[Motive]:
    motive = Motive(monkeypatch)
    motive.run(50)
    yield motive
    motive.source.close()
    motive.socket.close()


def wrong(frames: list[CapturedFrame]) -> int:
    return sum({name: place for name, (place, _) in frame.poses.items()} != PLACES for frame in frames)


@pytest.mark.parametrize("gone", [300, 340, 380])
def test_no_frame_of_a_restarted_system_is_used_under_its_old_names(motive: Motive, gone: int) -> None:
    assert len(motive.run(100)) >= 98
    motive.gone = True
    assert len(motive.run(gone)) <= 2
    motive.gone, motive.ids = False, {"cf1": 2, "cf2": 1}
    back = motive.run(100)
    assert len(back) >= 75 and wrong(back) == 0 and motive.source.detail == ""


def test_names_change_with_the_frame_that_says_so(motive: Motive) -> None:
    assert len(motive.run(100)) >= 98
    motive.ids = {"cf1": 2, "cf2": 1}
    after = motive.run(1, changed=True) + motive.run(100)
    assert len(after) >= 75 and wrong(after) == 0


def test_a_mark_of_change_that_stays_set_ends_no_names_again(motive: Motive) -> None:
    motive.run(100)
    assert len(motive.run(100, changed=True)) >= 75


def test_names_whose_change_was_not_heard_are_right_after_a_few_seconds(motive: Motive) -> None:
    motive.run(100)
    motive.ids = {"cf1": 2, "cf2": 1}
    motive.run(310)
    after = motive.run(100)
    assert len(after) >= 98 and wrong(after) == 0


def test_a_system_that_names_no_body_is_told(motive: Motive) -> None:
    motive.gone = True
    motive.run(120)
    motive.gone, motive.ids = False, {}
    assert motive.run(100) == [] and motive.source.detail == "its bodies have no names yet"


def exposed(frames: list[CapturedFrame]) -> list[int]:
    return [frame.arrival_ns - frame.processing_ns for frame in frames]


def test_frames_that_wait_on_their_way_are_dated_by_it_and_refused_where_they_waited_for_long(motive: Motive) -> None:
    waiting, used = [motive.frame()], 0
    for turn in range(150):
        motive.now_ns += 10 * MS
        motive.answer()
        waiting.append(motive.frame())
        if turn % 2 == 0:  # half of the frames get through: the queue grows to 0.75 s
            true_ns = motive.now_ns - (len(waiting) - 1) * 10 * MS - 5 * MS
            motive.send(waiting.pop(0))
            for at_ns in exposed(motive.source.poll(0.0)):
                used += 1
                assert abs(at_ns - true_ns) < 11 * MS
    assert 25 <= used <= 35 and motive.source.rejected["late"] >= 40 and "s late" in motive.source.detail


def test_a_frame_that_newer_ones_overtook_is_dated_before_them(motive: Motive) -> None:
    held = motive.frame()
    newer = motive.run(4)
    motive.send(held)
    (older,) = motive.source.poll(0.0)
    assert exposed([older])[0] < exposed(newer)[0]
    assert max(exposed(motive.run(10))) > max(exposed(newer)), "the clock of the system is believed on"


def test_the_clock_of_a_system_that_was_restarted_is_taken_anew(motive: Motive) -> None:
    motive.started_ns = motive.now_ns - 10**9
    assert len(motive.run(100)) >= 98 and not motive.source.rejected


def test_frames_of_a_group_are_taken_where_the_restarted_system_sends_them(motive: Motive) -> None:
    for place in ((GROUP, 0), (GROUP, 1), ("239.255.42.98", 1), ("", 1), (GROUP, 0)):
        motive.gone = True
        motive.run(150)
        group, port = place
        motive.gone, motive.server = False, replace(motive.server, group=group, data_port=motive.ports[port])
        motive.run(150)
        assert len(motive.run(50)) >= 48, place


def test_a_group_that_the_host_has_left_is_joined_again(motive: Motive) -> None:
    motive.server = replace(motive.server, group=GROUP, data_port=motive.ports[0])
    motive.run(400)
    frames = motive.source._frames
    assert frames is not None and len(motive.run(50)) >= 48
    membership = socket.inet_aton(GROUP) + socket.inet_aton(HOST)
    frames.setsockopt(socket.IPPROTO_IP, socket.IP_DROP_MEMBERSHIP, membership)  # as the host does without the adapter
    motive.run(250)
    assert len(motive.run(50)) >= 48


def test_frames_to_the_data_port_of_this_host_are_taken_where_none_come_to_the_port_that_asked(motive: Motive) -> None:
    motive.data_port_only = True
    motive.run(250)
    assert len(motive.run(50)) >= 48 and motive.source.detail == ""
    assert motive.source._frames is not None
    motive.data_port_only = False  # a datagram on each way is one frame
    for _ in range(10):
        motive.now_ns += 10 * MS
        datagram = motive.frame()
        motive.send(datagram)
        motive.socket.sendto(datagram, (HOST, motive.server.data_port))
        assert len(motive.source.poll(0.0)) == 1


def test_a_data_port_that_another_program_has_is_told_while_no_frame_comes(motive: Motive) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind((HOST, motive.server.data_port))
        motive.data_port_only = True
        assert motive.run(250) == [] and f"cannot be taken at port:{other.getsockname()[1]}" in motive.source.detail
        motive.data_port_only = False
        assert len(motive.run(100)) >= 75 and motive.source.detail == ""

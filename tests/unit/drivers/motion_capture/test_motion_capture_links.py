"""Vicon and Qualisys systems that do not answer, or answer no more: the library waits for them without end."""

import socket
import sys
import threading
import time
from types import SimpleNamespace

import pytest

from drivers.motion_capture.settings import parse_source
from drivers.motion_capture.sources import open_source
from groundstation.errors import DriverError


def waited(until, within_s: float = 5.0) -> None:
    deadline_s = time.monotonic() + within_s
    while not until() and time.monotonic() < deadline_s:
        time.sleep(0.01)
    assert until()


@pytest.mark.parametrize(("address", "port"), [("vicon://127.0.0.1", 801), ("qualisys://127.0.0.1:799", 800)])
def test_the_library_is_not_left_to_wait_for_a_system_that_does_not_answer(monkeypatch, address, port) -> None:
    asked: list[str] = []
    library = SimpleNamespace(connect=lambda kind, _: asked.append(kind))
    monkeypatch.setitem(sys.modules, "motioncapture", library)
    source = open_source(parse_source(address))
    waited(lambda: source.detail == f"no answer from 127.0.0.1:{port}")
    assert not asked and source.poll(0.01) == []
    source.close()


def test_a_process_whose_system_is_lost_ends_to_connect_anew(monkeypatch) -> None:
    now_ns, frames, ended = [10**12], iter(range(3)), threading.Event()

    class System:
        rigidBodies: dict[str, object] = {}  # noqa: N815, RUF012 - as the library calls it

        def waitForNextFrame(self) -> None:  # noqa: N802
            if next(frames, None) is None:
                ended.wait(10.0)

    monkeypatch.setattr("groundstation.bus.clock.now_ns", lambda: now_ns[0])
    monkeypatch.setattr("socket.create_connection", lambda *_: socket.socket())
    monkeypatch.setitem(sys.modules, "motioncapture", SimpleNamespace(connect=lambda *_: System()))
    source = open_source(parse_source("vicon://127.0.0.1"))
    came: list[object] = []

    def three_came() -> bool:
        came.extend(source.poll(0.01))
        return len(came) == 3

    waited(three_came)
    now_ns[0] += 4 * 10**9
    assert source.poll(0.01) == []
    now_ns[0] += 2 * 10**9
    with pytest.raises(DriverError, match=r"no frame from 127\.0\.0\.1 for 5 s"):
        source.poll(0.01)
    source.close()
    ended.set()

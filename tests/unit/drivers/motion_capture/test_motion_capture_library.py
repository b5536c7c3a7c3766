"""The library `motioncapture` itself, as LibrarySource uses it: its simulated system, and its connection address."""

import socket
import time
from collections.abc import Callable
from contextlib import closing

import pytest

pytest.importorskip("motioncapture")
import motioncapture

from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.settings import parse_source
from drivers.motion_capture.sources import LibrarySource, Source, open_source

SIMULATED = {"rigid_bodies": "cf1(1,2,3,1,0,0,0);cf2(0,-1,0.5,0.5,-0.5,0.5,0.5)", "frequency": "100"}
_real_connect: Callable[..., object] = motioncapture.connect


def polled(source: Source, count: int) -> list[CapturedFrame]:
    frames: list[CapturedFrame] = []
    deadline_s = time.monotonic() + 10.0
    while len(frames) < count and time.monotonic() < deadline_s:
        frames += source.poll(0.05)
    return frames


def test_its_simulated_system_is_read_as_any_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motioncapture, "connect", lambda _kind, _place: _real_connect("mock", SIMULATED))
    with closing(socket.create_server(("127.0.0.1", 0))) as system:  # asked for a sign of life first
        source = open_source(parse_source(f"qualisys://127.0.0.1:{system.getsockname()[1] - 1}"))
        assert isinstance(source, LibrarySource)
        frames = polled(source, 3)
        source.close()
    assert len(frames) >= 3 and source.detail == ""
    # Rotations are (x, y, z, w) here, and (w, x, y, z) in that system.
    assert frames[0].poses == {
        "cf1": ((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)),
        "cf2": ((0.0, -1.0, 0.5), (-0.5, 0.5, 0.5, 0.5)),
    }


def test_qualisys_is_reached_at_the_port_of_its_address() -> None:
    with closing(socket.create_server(("127.0.0.1", 0))) as system:
        system.settimeout(10.0)
        # The port is the system's base port; the little-endian protocol uses the next one.
        base = system.getsockname()[1] - 1
        source = open_source(parse_source(f"qualisys://127.0.0.1:{base}"))
        for _ in range(2):  # to see whether it answers, and by the library
            system.accept()[0].close()
        source.close()


def test_vrpn_without_a_server_is_no_frame() -> None:
    with closing(open_source(parse_source("vrpn://127.0.0.1"))) as source:
        deadline_s = time.monotonic() + 1.0
        while time.monotonic() < deadline_s:
            assert source.poll(0.05) == []
        assert source.detail == "no answer from 127.0.0.1"

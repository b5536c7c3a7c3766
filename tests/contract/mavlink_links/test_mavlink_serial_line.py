"""A serial line whose radio is unplugged, and one with two writing threads."""

import json
import os
import pty
import time
from pathlib import Path

import pytest

from drivers.mavlink.failsafe_transport import MavlinkFailsafe
from drivers.mavlink.links.serial import SerialLink
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder
from drivers.mavlink.wire.telemetry import Heartbeat


def test_an_unplugged_radio_is_counted_and_not_asked_without_a_pause():
    there, here = os.openpty()
    link = SerialLink(LinkSettings(target=f"serial:{os.ttyname(here)}:57600"))
    os.close(here)
    try:
        os.close(there)
        began = time.monotonic()
        assert [link.receive() for _ in range(3)] == [[], [], []]
        assert time.monotonic() - began >= 0.25, "a tenth of a second each"
        assert link.rejected["receive_failed"] == 3
    finally:
        link.close()


class Plug:
    """A device that can be unplugged and plugged in again under its name, as /dev/ttyUSB0 is."""

    def __init__(self, place: Path) -> None:
        self.place = place
        self.radio = self._here = -1

    def put_in(self) -> None:
        self.radio, self._here = pty.openpty()
        self.place.symlink_to(os.ttyname(self._here))
        os.set_blocking(self.radio, False)

    def pull_out(self) -> None:
        self.place.unlink()
        os.close(self._here)
        os.close(self.radio)


def test_a_radio_that_is_plugged_in_again_is_heard_and_spoken_to_again(tmp_path):
    plug = Plug(tmp_path / "ttyUSB0")
    plug.put_in()
    link = SerialLink(LinkSettings(target=f"serial:{plug.place}:57600"))
    beat = FrameEncoder(5, 1).encode(Heartbeat(2, 3, 1, 4, 3))
    os.write(plug.radio, beat)
    assert [heard.frame.system for heard in link.receive()] == [5]
    plug.pull_out()
    for _ in range(3):
        assert link.receive() == []
        link.send(5, Heartbeat(6, 8, 0, 0, 4))
    plug.put_in()
    assert link.receive() == []
    os.write(plug.radio, beat)
    assert [heard.frame.system for heard in link.receive()] == [5]
    link.send(5, Heartbeat(6, 8, 0, 0, 4))
    assert FrameDecoder().decode(os.read(plug.radio, 100)).system == 255
    link.close()
    plug.pull_out()


def test_a_transport_finds_a_radio_that_is_plugged_in_again(tmp_path):
    plug = Plug(tmp_path / "ttyUSB0")
    plug.put_in()
    transport = MavlinkFailsafe(json.dumps({"serial": f"{plug.place}:57600", "key_file": ""}), 2)
    transport.send(b"land", ())
    plug.pull_out()
    for _ in range(2):
        with pytest.raises(OSError):
            transport.send(b"land", ())
    plug.put_in()
    transport.send(b"land", ())
    assert os.read(plug.radio, 100) == b"land"
    transport.close()
    plug.pull_out()

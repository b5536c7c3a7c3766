"""A serial line whose radio is unplugged, or that carries less than all."""

import json
import os
import pty
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from drivers.mavlink.failsafe_transport import MavlinkFailsafe
from drivers.mavlink.links.serial import SerialLink
from drivers.mavlink.links.stream_cutter import StreamCutter
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.flight import CommandLong, OdometryMessage, SetPositionTargetLocalNed, command_to
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder
from drivers.mavlink.wire.names import MavCmd
from drivers.mavlink.wire.telemetry import Heartbeat
from drivers.mavlink.wire.verification import Signing


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


class SlowRadio(threading.Thread):
    """The other end of a line, which reads 5750 bytes a second; `came`: (time, message)."""

    def __init__(self, fd):
        super().__init__(daemon=True)
        self.came, self._fd, self._ends = [], fd, threading.Event()

    def run(self):
        cutter, decoder, began, read = StreamCutter(), FrameDecoder(), time.monotonic(), 0
        while not self._ends.wait(0.01):
            due, chunk = int(5750 * (time.monotonic() - began)) - read, b""
            with suppress(BlockingIOError):
                chunk = os.read(self._fd, due) if due > 0 else b""
            read += len(chunk) or due  # what it has no use for is lost
            for raw in cutter.feed(chunk):
                self.came.append((time.monotonic(), decoder.decode(raw).message))

    def stop(self):
        self._ends.set()
        self.join()

    def times_of(self, kind):
        return [at for at, message in self.came if isinstance(message, kind)]


def test_a_landing_passes_a_saturated_line_at_once_and_no_frame_is_cut(tmp_path):
    """Poses of a PX4 at 30 Hz and setpoints at 20 Hz need 8.7 kB/s; 57600 baud carry 5.76."""
    plug = Plug(tmp_path / "ttyUSB0")
    plug.put_in()
    link, radio = SerialLink(LinkSettings(target=f"serial:{plug.place}:57600")), SlowRadio(plug.radio)
    radio.start()
    land, ordered = command_to(2, MavCmd.NAV_LAND), []
    pose = OdometryMessage(1, 1, 12, 0.0, 0.0, 0.0, (1.0,) * 4, *(0.0,) * 6, (0.1,) * 21, (0.1,) * 21, 0, 2, 100)
    for turn in range(400):
        if turn % 3 == 0:
            link.send(2, pose)
        if turn % 5 == 0:
            link.send(2, SetPositionTargetLocalNed(turn, 2, 1, 8, 0x5C7, *(0.0,) * 11))
        if turn % 50 == 49:
            ordered.append(time.monotonic())
            link.send(2, land)
        time.sleep(0.01)
    time.sleep(0.6)
    link.close()
    radio.stop()
    plug.pull_out()
    landings = radio.times_of(CommandLong)
    assert len(landings) == len(ordered) == 8
    assert max(came - sent for came, sent in zip(landings, ordered, strict=True)) < 0.3
    assert min(len(radio.times_of(kind)) for kind in (OdometryMessage, SetPositionTargetLocalNed)) > 40
    assert link.rejected["send_dropped"] > 20 and set(link.rejected) == {"send_dropped"}


def test_the_rest_of_a_cut_frame_goes_before_the_next(tmp_path):
    """A device that is slower than its line takes a part of a frame only."""
    plug = Plug(tmp_path / "ttyUSB0")
    plug.put_in()
    link, cutter, decoder, came = (
        SerialLink(LinkSettings(target=f"serial:{plug.place}:4000000")),
        StreamCutter(),
        FrameDecoder(),
        0,
    )
    for _ in range(2000):
        link.send(2, command_to(2, MavCmd.NAV_LAND))
    deadline = time.monotonic() + 0.8
    while came < 2000 and time.monotonic() < deadline:
        with suppress(BlockingIOError):
            came += len([decoder.decode(raw) for raw in cutter.feed(os.read(plug.radio, 1000))])
        time.sleep(0.001)
    link.close()
    plug.pull_out()
    assert came == 2000 and not link.rejected


def test_a_vehicle_that_speaks_mavlink_1_is_counted_and_recorded(tmp_path):
    plug, noted = Plug(tmp_path / "ttyUSB0"), []
    plug.put_in()
    settings = LinkSettings(target=f"serial:{plug.place}:57600")
    beat = FrameEncoder(5, 1).encode(Heartbeat(2, 3, 1, 4, 3), old=True)
    for signing, recorded in ((None, [(5, beat)]), (Signing(bytes(32), 0), [])):
        link = SerialLink(settings, signing, lambda system, _, data, received: noted.append((system, data)))
        os.write(plug.radio, beat)
        assert link.receive() == [] and link.rejected == {"mavlink_1": 1} and noted == recorded
        link.close()
        noted.clear()
    plug.pull_out()

"""A second ground station that floods a forwarded link: set-points go out as evenly as without it, stops pass."""

import importlib.util
import itertools
import math
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from arrival_times import ANCILLARY, ArrivalTimes
from spare_time import needing_processors

from drivers.mavlink.wire.flight import CommandLong, SetPositionTargetLocalNed
from drivers.mavlink.wire.frames import MAX_DATAGRAM, FrameEncoder, id_of
from drivers.mavlink.wire.names import MavCmd
from drivers.mavlink.wire.service import ParamRequestList
from drivers.mavlink.wire.verification import number_of

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(180)]
HERE = Path(__file__).parent
_SPEC = importlib.util.spec_from_file_location(
    "mavlink_hangar", HERE.parent / "contract" / "mavlink_links" / "conftest.py"
)
assert _SPEC is not None and _SPEC.loader is not None
_hangar = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(_hangar)
hangar, port = _hangar.hangar, _hangar.port

STOPPED, FLOWN = 11, 12  # the rider floods the way of one; the other shows what that costs the link that both share
SECONDS, A_SECOND = 8.0, 1000
UNEVEN = 1.5  # what chance adds to the 99th percentile of some 80 gaps
VEHICLE_WAITS_S = 0.5  # GUID_TIMEOUT: beyond it an ArduPilot brakes
STOPS = "a second ground station stops it"
SAY = FrameEncoder(255, 190).encode
STOP = SAY(CommandLong(STOPPED, 1, MavCmd.NAV_LAND, 0))
FLOOD = (
    SAY(ParamRequestList(STOPPED, 1)),
    bytes(range(200)),
    SAY(CommandLong(STOPPED, 1, MavCmd.COMPONENT_ARM_DISARM, 0, 1.0)),
    STOP,
)


class TimedSocket:
    """An emulator's socket that notes when set-points arrived [s]."""

    def __init__(self, udp):
        self._udp, self._times, self.setpoints_s = udp, ArrivalTimes(udp), []

    def recvfrom(self, size):
        data, notes, _, source = self._udp.recvmsg(size, ANCILLARY)
        if number_of(data) == id_of(SetPositionTargetLocalNed):
            self.setpoints_s.append(self._times.of(notes))
        return data, source

    def __getattr__(self, name):
        return getattr(self._udp, name)

    def gaps_s(self, since, until):
        return np.diff([at for at in self.setpoints_s if since <= at < until])


def described(gaps_s):
    return f"{len(gaps_s)}, 99 % within {np.percentile(gaps_s, 99) * 1e3:.0f} ms, all {max(gaps_s) * 1e3:.0f} ms"


def until(condition, seconds, what):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"never: {what()}"
        time.sleep(0.01)


@pytest.fixture
def rider():
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    made.settimeout(5.0)
    yield made
    made.close()


def way_to(rider, system):
    """Return the address from which a rider is shown a vehicle's frames."""
    for _ in range(10_000):
        data, source = rider.recvfrom(MAX_DATAGRAM)
        if data[5] == system:
            return source
    raise AssertionError(f"nothing of system {system} was shown")


def flood(rider, place):
    """Send what a mad ground station may, 1000 times a second."""
    began = time.monotonic()
    for number, data in zip(range(int(SECONDS * A_SECOND)), itertools.cycle(FLOOD), strict=False):
        rider.sendto(data, place)
        time.sleep(max(0.0, began + (number + 1) / A_SECOND - time.monotonic()))


@needing_processors()
def test_a_flood_neither_delays_set_points_nor_hides_a_stop(hangar, port, rider, tmp_path):
    vehicles = {
        system: hangar.add(flavour, system, calls=("127.0.0.1", port), aided=True)[:2]
        for flavour, system in (("px4", STOPPED), ("ardupilot", FLOWN))
    }
    wire = vehicles[FLOWN][0].socket = TimedSocket(vehicles[FLOWN][0].socket)
    places = np.memmap(tmp_path / "places", dtype=float, mode="w+", shape=(len(vehicles), 4))
    log, ended = tmp_path / "pilot.txt", threading.Event()

    def locate():
        while not ended.wait(0.01):
            for place, (_, copter) in zip(places, vehicles.values(), strict=True):
                body = copter.airframe
                place[:] = body.x, body.y, body.z, body.yaw

    threading.Thread(target=locate, daemon=True).start()
    order = [str(HERE / "mavlink_pilot.py"), str(port), "pymavlink", str(tmp_path / "places")]
    with log.open("wb") as sink:
        pilot = subprocess.Popen([sys.executable, *order, str(rider.getsockname()[1])], stdout=sink, stderr=sink)
    try:
        speeds = lambda: [math.hypot(*c.airframe.velocity_stabilized()) for _, c in vehicles.values()]  # noqa: E731
        until(lambda: min(speeds()) > 0.25, 60, lambda: (speeds(), log.read_text()[-2000:]))
        place = way_to(rider, STOPPED)
        quiet_s = time.monotonic()
        time.sleep(SECONDS)
        flooded_s = time.monotonic()
        flood(rider, place)
        quiet, flooded = wire.gaps_s(quiet_s, flooded_s), wire.gaps_s(flooded_s, time.monotonic())
        until(lambda: not vehicles[STOPPED][1].airborne, 20, lambda: log.read_text()[-2000:])
        figures = f"gaps without and with the flood: {described(quiet)}; {described(flooded)}"
        print(figures)
        assert np.percentile(flooded, 99) <= UNEVEN * np.percentile(quiet, 99), figures
        assert max(flooded) < VEHICLE_WAITS_S, figures
        until(lambda: STOPS in log.read_text(), 10, lambda: log.read_text()[-2000:])
        assert log.read_text().count(STOPS) == 1
    finally:
        ended.set()
        pilot.kill()
        pilot.wait()

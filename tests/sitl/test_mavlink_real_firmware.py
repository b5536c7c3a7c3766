"""Our driver sets up and flies real ArduCopter and PX4 SITL binaries, without GPS, and our emulators likewise.

`make test-firmware`; building the binaries: docs/explanation/mavlink-vehicles.md#tests-with-other-programs.
"""

import math
import socket
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.links.opening import open_link
from drivers.mavlink.probe import probe
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.setup import ParameterSetup
from drivers.mavlink.wire.names import Flavour
from groundstation.bus.messages import Verb

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # for the helper modules of this folder
import mavlink_hangar  # noqa: E402
from firmware import VARIABLES, Firmware, binary_of  # noqa: E402
from mavlink_pilot import Pilot  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.interop, pytest.mark.timeout(300)]
hangar, port = mavlink_hangar.hangar, mavlink_hangar.port

SYSTEM = 5
M_PER_DEGREE = 111_319.5


class Truth(threading.Thread):
    """A vehicle's true pose from its binary's simulation, by a separate port: (x, y, z) [m] and yaw [rad], FLU."""

    def __init__(self, port, ask):
        super().__init__(daemon=True)
        self.place, self._origin, self._ask = None, None, ask
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        self._socket.settimeout(0.2)
        self._mav = dialect.MAVLink(None, 254, 190)
        self._mav.robust_parsing = True
        self.closing = threading.Event()
        self.start()

    def run(self):
        due = 0.0
        while not self.closing.is_set():
            with suppress(TimeoutError):
                data, source = self._socket.recvfrom(2048)
                if self._ask and time.monotonic() > due:
                    due = time.monotonic() + 1.0
                    command = (SYSTEM, 1, 511, 0, dialect.MAVLINK_MSG_ID_SIM_STATE, 20_000, 0, 0, 0, 0, 0)
                    message = dialect.MAVLink_command_long_message(*command)
                    self._socket.sendto(message.pack(self._mav), source)
                for message in self._mav.parse_buffer(data) or []:
                    self._note(message)
        self._socket.close()

    def _note(self, message):
        match message.get_type():
            case "SIM_STATE":
                exact = getattr(message, "lat_int", 0)
                degrees = (message.lat_int / 1e7, message.lon_int / 1e7) if exact else (message.lat, message.lon)
                self._keep(*degrees, message.alt, message.yaw)
            case "HIL_STATE_QUATERNION":
                w, x, y, z = message.attitude_quaternion
                yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
                self._keep(message.lat / 1e7, message.lon / 1e7, message.alt / 1e3, yaw)

    def _keep(self, latitude, longitude, altitude, yaw):
        self._origin = self._origin or (latitude, longitude, altitude)
        north = (latitude - self._origin[0]) * M_PER_DEGREE
        east = (longitude - self._origin[1]) * M_PER_DEGREE * math.cos(math.radians(latitude))
        self.place = (north, -east, altitude - self._origin[2]), -yaw


def start(flavour, folder):
    """Start the binary that a variable names, with its factory parameters; skips without one."""
    if not binary_of(flavour):
        pytest.skip(f"{VARIABLES[flavour]} names no SITL binary: none is in a package registry")
    return Firmware(flavour, folder, SYSTEM)


def set_up(flavour, port):
    """Meet the vehicle, write the parameters for indoor flight and read them back."""
    link = open_link(LinkSettings(target=f"udpin:127.0.0.1:{port}"))
    try:
        found = probe(link, 10.0)
        assert list(found) == [SYSTEM] and found[SYSTEM].flavour == flavour
        setup = ParameterSetup(link, SYSTEM, Flavour[flavour.upper()], 255)
        setup.connect()
        refused = [d.text for d in setup.differences() if not setup.apply(d.wanted)]
        assert refused == [] and [d.text for d in setup.differences()] == []
    finally:
        link.close()


def fly(port, kind, flavour, truth, patience_s):
    """Take off, fly forward at 0.4 m/s for 6 s and land, on the true position; returns the distance flown [m]."""
    pad, yaw = truth()
    options = {"pad_m": pad[:2], "pad_yaw_rad": yaw}
    pilot = Pilot(port, kind, lambda vehicle: truth(), {SYSTEM: flavour}, **options)
    vehicle, watchdog, turns = pilot.fleet.vehicles[SYSTEM], pilot.hosts[0].watchdog, iter(range(10**9))

    def until(condition, seconds, verb=None, mode=""):
        deadline, due = time.monotonic() + seconds, 0.0
        while not condition():
            assert time.monotonic() < deadline, f"{watchdog.mode}: {watchdog.vehicle}; {pilot.process.texts[-8:]}"
            if verb is not None and time.monotonic() > due:
                due = time.monotonic() + 2.0
                pilot.order(verb, mode)
            pilot.turn(next(turns))

    try:
        until(lambda: watchdog.mode == "LANDED" and not watchdog.vehicle.not_ready, patience_s)
        until(lambda: watchdog.mode == "HOVER", 40, Verb.TAKEOFF, "LANDED")
        until(lambda: truth()[0][2] - pad[2] > 0.5, 15)
        until(lambda: watchdog.mode == "TRACK", 5, Verb.TRACK, "HOVER")
        begin, began = truth()[0], time.monotonic()
        until(lambda: time.monotonic() - began > 6.0, 10)
        flown = math.dist(begin[:2], truth()[0][:2])
        until(lambda: watchdog.mode == "LANDED", 40, Verb.LAND, "TRACK")
        assert not vehicle.telemetry.base_mode & 128 and truth()[0][2] - pad[2] < 0.3
    finally:
        pilot.fleet.close()
    return flown


@pytest.mark.firmware
@pytest.mark.parametrize("kind", ["pymavlink", "mavsdk"])
@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_real_firmware_is_set_up_and_flown(flavour, kind, tmp_path):
    firmware = start(flavour, tmp_path)
    truth = None
    try:
        set_up(flavour, firmware.port)
        firmware.restart()  # parameters take effect at the next start
        truth = Truth(firmware.truth_port, flavour == "ardupilot")
        deadline = time.monotonic() + 30
        while truth.place is None:
            assert firmware.process.poll() is None, (tmp_path / "log2.txt").read_text(errors="replace")[-2000:]
            assert time.monotonic() < deadline, "the simulation does not tell where it is"
            time.sleep(0.1)
        assert 1.2 < fly(firmware.port, kind, flavour, lambda: truth.place, patience_s=90) < 3.2
    finally:
        if truth is not None:
            truth.closing.set()
        firmware.end()


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
@pytest.mark.exhaustive
def test_emulated_vehicle_is_set_up_and_flown_by_the_same_steps(hangar, port, flavour):
    _, copter, _ = hangar.add(flavour, SYSTEM, calls=("127.0.0.1", port), configured=False)
    set_up(flavour, port)
    body = copter.airframe
    flown = fly(port, "pymavlink", flavour, lambda: ((body.x, body.y, body.z), body.yaw), patience_s=30)
    assert 1.2 < flown < 3.2

"""Our driver sets up and flies real ArduCopter and PX4 SITL binaries, without GPS, and our emulators likewise.

`make test-firmware`; building the binaries: docs/explanation/mavlink-vehicles.md#tests-with-other-programs.
"""

import math
import socket
import sys
import threading
import time
from contextlib import contextmanager, suppress
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
# Custom modes: ours (OFFBOARD, GUIDED), and those in which a pilot stops it (AUTO.LOITER, BRAKE: in LOITER it would
# sink to the floor, because ArduPilot's simulated transmitter has its throttle down).
OURS = {Flavour.PX4: 6 << 16, Flavour.ARDUPILOT: 4}
PILOTS = {"px4": (4, 3), "ardupilot": (17,)}
LOITER = 5


class Truth(threading.Thread):
    """A vehicle's true pose from its binary's simulation, by a separate port: (x, y, z) [m] and yaw [rad], FLU."""

    def __init__(self, port, ask):
        super().__init__(daemon=True)
        self.place, self._origin, self._ask = None, None, ask
        self._source: tuple[str, int] = ("127.0.0.1", 0)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        self._socket.settimeout(0.2)
        self.mav = dialect.MAVLink(None, 254, 190)
        self.mav.robust_parsing = True
        self.closing = threading.Event()
        self.start()

    def run(self):
        due = 0.0
        while not self.closing.is_set():
            with suppress(TimeoutError):
                data, self._source = self._socket.recvfrom(2048)
                if self._ask and time.monotonic() > due:
                    due = time.monotonic() + 1.0
                    self.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, dialect.MAVLINK_MSG_ID_SIM_STATE, 20_000)
                for message in self.mav.parse_buffer(data) or []:
                    self._note(message)
        self._socket.close()

    def command(self, number: int, *parameters: float) -> None:
        """Send a command as another station would."""
        filled = (*parameters, *[0] * (7 - len(parameters)))
        self.send(dialect.MAVLink_command_long_message(SYSTEM, 1, number, 0, *filled))

    def send(self, message) -> None:
        """Send a message as another station would."""
        self._socket.sendto(message.pack(self.mav), self._source)

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


class Flight:
    """One vehicle under our driver, on its true position; `with` closes the driver. Takes off on entry."""

    def __init__(self, port, kind, flavour, truth, patience_s, **options):
        self.truth, (self.pad, yaw) = truth, truth()
        options |= {"pad_m": self.pad[:2], "pad_yaw_rad": yaw}
        self.pilot = Pilot(port, kind, lambda vehicle: truth(), {SYSTEM: flavour}, **options)
        self.vehicle, self.watchdog = self.pilot.fleet.vehicles[SYSTEM], self.pilot.hosts[0].watchdog
        self._turns, self._patience_s = iter(range(10**9)), patience_s

    def __enter__(self):
        self.until(lambda: self.watchdog.mode == "LANDED" and not self.watchdog.vehicle.not_ready, self._patience_s)
        self.until(lambda: self.watchdog.mode == "HOVER", 40, Verb.TAKEOFF, "LANDED")
        self.until(lambda: self.height_m > 0.5, 15)
        self.until(lambda: self.watchdog.mode == "TRACK", 5, Verb.TRACK, "HOVER")
        return self

    def __exit__(self, *_):
        self.pilot.fleet.close()

    @property
    def height_m(self):
        return self.truth()[0][2] - self.pad[2]

    @property
    def obeys(self):
        """Whether it reports our mode and the driver steers it."""
        return self.vehicle.telemetry.custom_mode == OURS[self.vehicle.flavour] and not self.vehicle.orders.yields

    def until(self, condition, seconds, verb=None, mode=""):
        deadline, due = time.monotonic() + seconds, 0.0
        while not condition():
            state = f"{self.watchdog.mode}: {self.watchdog.vehicle}; {self.pilot.process.texts[-8:]}"
            assert time.monotonic() < deadline, state
            if verb is not None and time.monotonic() > due:
                due = time.monotonic() + 2.0
                self.pilot.order(verb, mode)
            self.pilot.turn(next(self._turns))

    def go_on(self, seconds):
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() > end, seconds + 4.0)

    def land(self):
        self.until(lambda: self.watchdog.mode == "LANDED", 40, Verb.LAND, "TRACK")
        assert not self.vehicle.telemetry.base_mode & 128 and self.height_m < 0.3


def fly(port, kind, flavour, truth, patience_s):
    """Take off, fly forward at 0.4 m/s for 6 s and land; returns the distance flown [m]."""
    with Flight(port, kind, flavour, truth, patience_s) as flight:
        begin = truth()[0]
        flight.go_on(6.0)
        flown = math.dist(begin[:2], truth()[0][:2])
        flight.land()
    return flown


@contextmanager
def known(flavour, folder):
    """Yield a binary set up for indoor flight, and its truth once it tells that."""
    firmware, truth = start(flavour, folder), None
    try:
        set_up(flavour, firmware.port)
        firmware.restart()  # parameters take effect at the next start
        truth = Truth(firmware.truth_port, flavour == "ardupilot")
        deadline = time.monotonic() + 30
        while truth.place is None:
            assert firmware.process.poll() is None, (folder / "log2.txt").read_text(errors="replace")[-2000:]
            assert time.monotonic() < deadline, "the simulation does not tell where it is"
            time.sleep(0.1)
        yield firmware, truth
    finally:
        if truth is not None:
            truth.closing.set()
        firmware.end()


@pytest.mark.firmware
@pytest.mark.parametrize("kind", ["pymavlink", "mavsdk"])
@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_real_firmware_is_set_up_and_flown(flavour, kind, tmp_path):
    with known(flavour, tmp_path) as (firmware, truth):
        assert 1.2 < fly(firmware.port, kind, flavour, lambda: truth.place, patience_s=90) < 3.2


@pytest.mark.firmware
@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_real_firmware_that_a_pilot_stops_is_taken_back_by_resume(flavour, tmp_path):
    """Four times, at four phases of its heartbeat."""
    with (
        known(flavour, tmp_path) as (firmware, truth),
        Flight(firmware.port, "pymavlink", flavour, lambda: truth.place, patience_s=90) as flight,
    ):
        for stop in range(4):
            flight.go_on(1.0 + 0.23 * stop)
            truth.command(dialect.MAV_CMD_DO_SET_MODE, 1, *PILOTS[flavour])
            flight.until(lambda: flight.vehicle.orders.yields, 5)
            flight.go_on(0.5)
            flight.pilot.order(Verb.RESUME, flight.watchdog.mode)
            flight.until(lambda: flight.obeys, 4)
            flight.go_on(3.0)
            assert flight.watchdog.mode == "TRACK", flight.watchdog.reason
            assert flight.obeys and flight.height_m > 0.5
        flight.land()


@pytest.mark.firmware
def test_a_real_px4_that_another_station_sends_up_slowly_is_landed_above_the_fence(tmp_path):
    """At 0.5 m/s, below every limit of speed."""
    fence = ((-30.0, 30.0), (-30.0, 30.0), (0.0, 2.0))
    with (
        known("px4", tmp_path) as (firmware, truth),
        Flight(firmware.port, "pymavlink", "px4", lambda: truth.place, patience_s=90, fence_m=fence) as flight,
    ):
        flight.go_on(2.0)
        truth.send(dialect.MAVLink_param_set_message(SYSTEM, 1, b"MPC_Z_V_AUTO_UP", 0.5, 9))
        flight.go_on(1.0)
        here = (math.nan,) * 3
        truth.command(dialect.MAV_CMD_DO_REPOSITION, -1, 1, 0, *here, 6.0)
        flight.until(lambda: flight.watchdog.mode == "LANDING", 15)
        assert flight.watchdog.reason.endswith("above the fence, not by our orders")
        landed_m = highest_m = flight.height_m

        def is_down() -> bool:
            nonlocal highest_m
            highest_m = max(highest_m, flight.height_m)
            return bool(flight.watchdog.mode == "LANDED")

        flight.until(is_down, 40)
        print(f"landed at {landed_m:.2f} m, highest {highest_m:.2f} m")
        assert 2.0 < landed_m < 2.6 and highest_m < 3.0


@pytest.mark.firmware
@pytest.mark.parametrize("height_m", [0.85, 0.03])
def test_real_copter_that_comes_down_is_let_down(height_m, tmp_path):
    """In LOITER it sinks to the floor; RESUME is too late to catch it, and made it shoot off at 3.6 m/s from there."""
    with (
        known("ardupilot", tmp_path) as (firmware, truth),
        Flight(firmware.port, "pymavlink", "ardupilot", lambda: truth.place, patience_s=90) as flight,
    ):
        flight.go_on(2.0)
        truth.command(dialect.MAV_CMD_DO_SET_MODE, 1, LOITER)
        flight.until(lambda: flight.height_m < height_m, 6)
        place = truth.place[0]
        flight.pilot.order(Verb.RESUME, "TRACK")
        flight.until(lambda: flight.watchdog.mode == "LANDED", 15)
        assert math.dist(place[:2], truth.place[0][:2]) < 0.3


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
@pytest.mark.exhaustive
def test_emulated_vehicle_is_set_up_and_flown_by_the_same_steps(hangar, port, flavour):
    _, copter, _ = hangar.add(flavour, SYSTEM, calls=("127.0.0.1", port), configured=False)
    set_up(flavour, port)
    body = copter.airframe
    flown = fly(port, "pymavlink", flavour, lambda: ((body.x, body.y, body.z), body.yaw), patience_s=30)
    assert 1.2 < flown < 3.2

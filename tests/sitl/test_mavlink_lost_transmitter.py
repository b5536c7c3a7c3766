"""Who flies a real ArduCopter by sticks: a pilot while the transmitter is alive, and no other ground station.

`make test-firmware`. The simulation's own receiver takes the sticks by UDP; a parameter switches the transmitter off.
"""

import socket
import struct
import sys
import threading
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # for the helper modules of this folder
from test_mavlink_real_firmware import SYSTEM, Flight, known  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.firmware, pytest.mark.timeout(300)]
ALT_HOLD = 2
RECEIVER = 5501 + 10 * SYSTEM
DOWN, CENTRE, UP = 1000, 1500, 1900


class Sticks(threading.Thread):
    """A transmitter whose throttle stick is down, as arming demands, until moved; `with` switches it on."""

    def __init__(self):
        super().__init__(daemon=True)
        self.throttle, self._over = DOWN, threading.Event()

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self._over.set()

    def run(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            while not self._over.wait(0.02):
                channels = (CENTRE, CENTRE, self.throttle, CENTRE, 1000, 1000, 1000, 1000)
                out.sendto(struct.pack("<8H", *channels), ("127.0.0.1", RECEIVER))


def write(truth, name, value):
    truth.send(dialect.MAVLink_param_set_message(SYSTEM, 1, name.encode(), value, dialect.MAV_PARAM_TYPE_REAL32))


# By itself it notices after a second, at 4.7 m/s, and brakes with 2.5 m/s^2; we land what climbs without a pilot.
@pytest.mark.parametrize(("told", "most_m"), [(3, 11.0), (0, 6.0)])
def test_a_copter_whose_pilots_transmitter_dies_comes_down(told, most_m, tmp_path):
    with (
        known("ardupilot", tmp_path) as (firmware, truth),
        Sticks() as sticks,
        Flight(firmware.port, "pymavlink", "ardupilot", lambda: truth.place, patience_s=90) as flight,
    ):
        write(truth, "FS_THR_ENABLE", told)
        sticks.throttle = CENTRE
        flight.go_on(2.0)
        truth.command(dialect.MAV_CMD_DO_SET_MODE, 1, ALT_HOLD)
        flight.until(lambda: flight.vehicle.telemetry.custom_mode == ALT_HOLD, 3)
        sticks.throttle = UP
        flight.until(lambda: flight.height_m > 1.6, 8)
        write(truth, "SIM_RC_FAIL", 1)
        highest = 0.0

        def is_down():
            nonlocal highest
            highest = max(highest, flight.height_m)
            return flight.watchdog.mode == "LANDED"

        flight.until(is_down, 60)
        print("FS_THR_ENABLE", told, "highest", highest, flight.watchdog.reason)
        assert highest < most_m


def test_sticks_of_another_ground_station_do_not_fly_it(tmp_path):
    with (
        known("ardupilot", tmp_path) as (firmware, truth),
        Sticks() as sticks,
        Flight(firmware.port, "pymavlink", "ardupilot", lambda: truth.place, patience_s=90) as flight,
    ):
        sticks.throttle = CENTRE
        flight.go_on(2.0)
        truth.command(dialect.MAV_CMD_DO_SET_MODE, 1, ALT_HOLD)
        flight.until(lambda: flight.vehicle.telemetry.custom_mode == ALT_HOLD, 3)
        truth.mav.srcSystem = 255  # as most ground stations, and ours
        channels = (CENTRE, 1200, UP, CENTRE, 0, 0, 0, 0)
        begin, furthest = truth.place[0], 0.0
        for _ in range(40):
            truth.send(dialect.MAVLink_rc_channels_override_message(SYSTEM, 1, *channels))
            flight.go_on(0.05)
            furthest = max(furthest, flight.height_m)
        print("highest", furthest, "moved", begin, truth.place[0])
        assert furthest < 1.7

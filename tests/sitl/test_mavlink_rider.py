"""A second ground station floods a forwarded link: setpoints stay as regular as without it, and stops pass."""

import itertools
import socket
import time

import pytest
from ridden_flight import FLAVOURS, described, hangar, is_on_time, port, ridden
from spare_time import needing_processors

from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.frames import MAX_DATAGRAM, FrameEncoder
from drivers.mavlink.wire.names import MavCmd
from drivers.mavlink.wire.service import ParamRequestList

__all__ = ["hangar", "port"]  # fixtures

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(180)]

# The rider floods the forwarded path of one vehicle; the other shows the cost to their common link.
STOPPED, FLOWN = FLAVOURS["px4"], FLAVOURS["ardupilot"]
SECONDS, A_SECOND = 8.0, 1000
STOPS = "a second ground station stops it"
SAY = FrameEncoder(255, 190).encode
STOP = SAY(CommandLong(STOPPED, 1, MavCmd.NAV_LAND, 0))
FLOOD = (
    SAY(ParamRequestList(STOPPED, 1)),
    bytes(range(200)),
    SAY(CommandLong(STOPPED, 1, MavCmd.COMPONENT_ARM_DISARM, 0, 1.0)),
    STOP,
)


@pytest.fixture
def rider():
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    made.settimeout(5.0)
    yield made
    made.close()


def way_to(rider, system):
    """Return the address from which a rider receives a vehicle's frames."""
    for _ in range(10_000):
        data, source = rider.recvfrom(MAX_DATAGRAM)
        if data[5] == system:
            return source
    raise AssertionError(f"nothing of system {system} was shown")


def flood(rider, place):
    """Send a faulty ground station's messages, 1000 times a second."""
    began = time.monotonic()
    for number, data in zip(range(int(SECONDS * A_SECOND)), itertools.cycle(FLOOD), strict=False):
        rider.sendto(data, place)
        time.sleep(max(0.0, began + (number + 1) / A_SECOND - time.monotonic()))


@pytest.mark.exhaustive
@needing_processors()
def test_a_flood_neither_delays_setpoints_nor_hides_a_stop(hangar, port, rider, tmp_path):
    with ridden(hangar, port, tmp_path, rider.getsockname()[1]) as flight:
        place, wire = way_to(rider, STOPPED), flight.wires[FLOWN]
        quiet_s = time.monotonic()
        time.sleep(SECONDS)
        flooded_s = time.monotonic()
        flood(rider, place)
        quiet, flooded = wire.gaps_s(quiet_s, flooded_s), wire.gaps_s(flooded_s, time.monotonic())
        flight.until(lambda: not flight.airborne(STOPPED), 20)
        figures = f"gaps without and with the flood: {described(quiet)}; {described(flooded)}"
        print(figures)
        assert is_on_time(quiet, flooded), figures
        flight.until(lambda: STOPS in flight.log, 10)
        assert flight.log.count(STOPS) == 1

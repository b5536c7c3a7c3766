"""The driver as a process runs it, on real sockets: a fleet on one port, strangers, duplicates, a vehicle that goes."""

import threading
import time

import pytest

from drivers.mavlink.driver import RATE_HZ, Fleet, hosts_of
from drivers.mavlink.settings import MavlinkDriverSettings
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.topics import IMU, ODOMETRY, VEHICLE_STATUS


class Process:
    """What `Child` offers, without a process."""

    def __init__(self):
        exchange = MemoryExchange()
        self.other = MemoryBus(exchange, "lab", "other")
        self.bus = MemoryBus(exchange, "lab", "mavlink")
        self.name, self.section = "mavlink", "{}"
        self.stop_requested, self.supervisor_alive, self.supervisor_fresh = False, True, True
        self.events = []

    def beat(self):
        pass

    def ready(self, detail=""):
        pass

    def degrade(self, detail):
        pass

    def tick_status(self, ticks=0, overruns=0, overflowed=0):
        pass

    def sleep_until(self, deadline_ns):
        return True

    def event(self, severity, text, remedy="", entity=None):
        self.events.append(text)


class Flying:
    """A fleet with hosts, turned by this thread."""

    def __init__(self, target, vehicles, kind="pymavlink"):
        self.process = Process()
        self.settings = MavlinkDriverSettings.model_validate(
            {
                "link": {"target": target, "kind": kind},
                "vehicles": [{"name": f"v{s}", "system_id": s, "flavour": f} for s, f in vehicles.items()],
            }
        )
        self.heard = {t: self.process.other.subscribe([t], capacity=100_000) for t in (ODOMETRY, IMU, VEHICLE_STATUS)}
        self.fleet = Fleet(self.process, self.settings)
        self.hosts = hosts_of(self.process, self.fleet, self.settings)

    def turn(self, seconds, until=lambda: False):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline and not until():
            now = time.monotonic_ns()
            self.fleet.turn(now)
            for host in self.hosts:
                host.turn(now)
            time.sleep(1 / RATE_HZ)
        return until()

    def messages(self, topic):
        return [r.message for r in self.heard[topic].drain()]

    def close(self):
        self.fleet.close()


@pytest.mark.parametrize("kind", ["pymavlink", "mavsdk"])
def test_both_flavours_on_one_port_come_to_be_ready(hangar, port, kind):
    place = ("127.0.0.1", port)
    flying = Flying(f"udpin:127.0.0.1:{port}", {21: "px4", 22: "ardupilot"}, kind)
    hangar.add("px4", 21, calls=place)
    hangar.add("ardupilot", 22, calls=place)
    hangar.add("px4", 23, calls=place)
    try:
        ready = lambda: all(h.watchdog.mode == "LANDED" and not h.watchdog.vehicle.not_ready for h in flying.hosts)  # noqa: E731
        assert flying.turn(10.0, ready), [h.watchdog.vehicle.not_ready for h in flying.hosts]
        flying.messages(ODOMETRY), flying.messages(IMU)
        flying.turn(1.0)
        odometry, imu = flying.messages(ODOMETRY), flying.messages(IMU)
        assert {m.header.entity for m in odometry} == {"v21", "v22"}
        assert len(odometry) > 60 and len(imu) > 120
        assert flying.fleet.link.rejected["unknown_system"] > 0
        assert [t for t in flying.process.events if "system 23" in t] == [
            "system 23 answers, which is not in the field file"
        ]
    finally:
        flying.close()


def test_wrong_flavour_is_refused(hangar):
    _, _, (address, port) = hangar.add("px4", 9)
    flying = Flying(f"udpout:{address}:{port}", {9: "ardupilot"})
    try:
        assert flying.turn(3.0, lambda: flying.fleet.vehicles[9].health(0).rejected.get("wrong_flavour", 0) > 0)
        assert flying.hosts[0].watchdog.mode == "CONNECTING"
    finally:
        flying.close()


def test_a_vehicle_that_vanishes_is_lost_and_found_again(hangar):
    emulator, _, (address, port) = hangar.add("px4", 9)
    flying = Flying(f"udpout:{address}:{port}", {9: "px4"})
    host = flying.hosts[0]
    try:
        assert flying.turn(8.0, lambda: host.watchdog.mode == "LANDED")
        emulator.silent = True
        assert flying.turn(2.0, lambda: not host.watchdog.vehicle.fresh)
        flying.turn(1.2)
        assert any("does not answer" in text for text in flying.process.events)
        emulator.silent = False
        assert flying.turn(3.0, lambda: host.watchdog.vehicle.fresh)
    finally:
        flying.close()


def test_close_ends_the_reader(hangar):
    _, _, (address, port) = hangar.add("px4", 9)
    before = threading.active_count()
    flying = Flying(f"udpout:{address}:{port}", {9: "px4"})
    flying.turn(0.2)
    flying.close()
    assert threading.active_count() == before

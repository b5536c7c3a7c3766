"""The real driver with a stand-in for the tracker; as a process, with two vehicles on a port.

`PORT LINK PLACES [RIDER [ALLOWED]]`.

The stand-in sends the vehicles' poses to the driver (as a process: from the file PLACES, x, y, z, yaw of each as
doubles in the order of FLAVOURS), takes off and flies them forward at 0.4 m/s, at 1.2 m. RIDER: the port of a second
ground station on this host, to which both are forwarded; ALLOWED: its rights besides observing and stopping.
"""

import itertools
import sys
import time
from collections import deque
from pathlib import Path

import numpy as np

from drivers.mavlink.driver import RATE_HZ, Fleet, hosts_of
from drivers.mavlink.settings import MavlinkDriverSettings
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Command, EntityEstimate, Estimate, Lease, VelocitySetpoint, Verb
from groundstation.bus.topics import COMMAND, ESTIMATE, LEASE, SETPOINT

sys.path.insert(0, str(Path(__file__).parents[1] / "contract"))
from mavlink_process import FakeProcess

HEIGHT_M = 1.2
FLAVOURS = {11: "px4", 12: "ardupilot"}
_COVARIANCE = tuple(1e-4 if place % 5 == 0 else 0.0 for place in range(16))


def places_of(path):
    """Return a function that reads ((x, y, z) [m], yaw [rad]) of a vehicle in the world from a file by others."""
    places = np.memmap(path, dtype=float, mode="r", shape=(len(FLAVOURS), 4))
    rows = {f"v{system}": row for row, system in enumerate(FLAVOURS)}

    def where(vehicle):
        x, y, z, yaw = (float(value) for value in places[rows[vehicle.name]])
        return (x, y, z), yaw

    return where


class Pilot:
    """The driver and the tracker's part; turn() runs one cycle of both. fence_m: bounds along x, y, z, if any."""

    def __init__(self, port: int, kind: str, where, flavours=FLAVOURS, fence_m=None, **vehicle) -> None:
        exchange, self.orders, self.where = MemoryExchange(), 0, where
        self.places: dict[str, deque] = {}
        self.bus = MemoryBus(exchange, "lab", "tracker")
        self.process = FakeProcess(MemoryBus(exchange, "lab", "mavlink"))
        vehicles = [{"name": f"v{s}", "system_id": s, "flavour": f, **vehicle} for s, f in flavours.items()]
        link = {"target": f"udpin:127.0.0.1:{port}", "kind": kind}
        settings = MavlinkDriverSettings.model_validate(
            {"link": link, "vehicles": vehicles, "safety": {"fence_m": fence_m}}
        )
        self.fleet = Fleet(self.process, settings)
        self.hosts = hosts_of(self.process, self.fleet, settings)

    def order(self, verb: Verb, mode: str) -> None:
        """Command the vehicles in a mode, and ready, repeatedly, as a patient operator would."""
        ready = [h.vehicle.name for h in self.hosts if h.watchdog.mode == mode and not h.watchdog.vehicle.not_ready]
        if not ready:
            return
        header, expires_ns, self.orders = self.bus.header("team"), time.monotonic_ns() + 10**10, self.orders + 1
        self.bus.publish(LEASE, Lease(header=header, holder="op", expires_ns=expires_ns))
        command = Command(
            header=header, id=f"c{self.orders}", verb=verb, scope=tuple(ready), issuer="op", expires_ns=expires_ns
        )
        self.bus.publish(COMMAND, command)

    def track(self) -> None:
        entities = []
        for vehicle in self.fleet.vehicles.values():
            place = self.where(vehicle)
            if place is None:
                continue
            mean = (*place[0], place[1])
            entities.append(
                EntityEstimate(
                    name=vehicle.name, kind="robot", mean=mean, covariance=_COVARIANCE,
                    velocity_m_s=self._velocity(vehicle.name, place[0]), converged=True, age_s=0.0,
                )
            )  # fmt: skip
            setpoint = VelocitySetpoint(
                header=self.bus.header(vehicle.name), velocity_m_s=(0.4, 0.0, 0.5 * (HEIGHT_M - mean[2])),
                yaw_rate_rad_s=0.0, lifetime_ms=300, epoch=1,
            )  # fmt: skip
            self.bus.publish(SETPOINT, setpoint)
        self.bus.publish(ESTIMATE, Estimate(header=self.bus.header("team"), entities=tuple(entities), epoch=1))

    def _velocity(self, name: str, place) -> tuple[float, ...]:
        """Return the smoothed velocity over a quarter of a second; the driver corrects the vehicle's own by it."""
        now, places = time.monotonic(), self.places.setdefault(name, deque(maxlen=64))
        places.append((now, place))
        while now - places[0][0] > 0.25:
            places.popleft()
        (before, old), elapsed = places[0], now - places[0][0]
        return tuple((b - a) / elapsed for a, b in zip(old, place, strict=True)) if before < now else (0.0, 0.0, 0.0)

    def turn(self, turn: int) -> None:
        now = time.monotonic_ns()
        self.fleet.turn(now)
        for host in self.hosts:
            host.turn(now)
        if turn % 8 == 0:
            self.track()
        time.sleep(1 / RATE_HZ)

    def fly(self) -> None:
        for turn in itertools.count():
            self.turn(turn)
            if turn % 300 == 0:
                self.order(Verb.TAKEOFF, "LANDED")
                self.order(Verb.TRACK, "HOVER")
                print(*self.process.texts, sep="\n", flush=True)
                self.process.events.clear()


if __name__ == "__main__":
    riding: dict = {"forward": f"udp:127.0.0.1:{sys.argv[4]}"} if len(sys.argv) > 4 else {}
    riding |= {"forward_allows": sys.argv[5:]}
    Pilot(int(sys.argv[1]), sys.argv[2], places_of(sys.argv[3]), **riding).fly()

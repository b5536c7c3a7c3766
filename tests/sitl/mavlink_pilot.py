"""A process with the real driver for two vehicles on one port, and a stand-in for the tracker: `PORT LINK`.

The stand-in tells the driver where the vehicles say they are, takes off and flies them forward at 0.4 m/s.
"""

import itertools
import sys
import time
from pathlib import Path

from drivers.mavlink.driver import RATE_HZ, Fleet, hosts_of
from drivers.mavlink.settings import MavlinkDriverSettings
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Command, EntityEstimate, Estimate, Lease, VelocitySetpoint, Verb
from groundstation.bus.topics import COMMAND, ESTIMATE, LEASE, SETPOINT

sys.path.insert(0, str(Path(__file__).parents[1] / "contract"))
from mavlink_process import FakeProcess

PX4, ARDUPILOT = 11, 12
_COVARIANCE = tuple(1e-4 if place % 5 == 0 else 0.0 for place in range(16))


class Pilot:
    def __init__(self, port: int, kind: str) -> None:
        exchange, self.orders = MemoryExchange(), 0
        self.bus, self.process = (
            MemoryBus(exchange, "lab", "tracker"),
            FakeProcess(MemoryBus(exchange, "lab", "mavlink")),
        )
        vehicles = [
            {"name": f"v{system}", "system_id": system, "flavour": flavour}
            for system, flavour in ((PX4, "px4"), (ARDUPILOT, "ardupilot"))
        ]
        link = {"target": f"udpin:127.0.0.1:{port}", "kind": kind}
        settings = MavlinkDriverSettings.model_validate({"link": link, "vehicles": vehicles})
        self.fleet = Fleet(self.process, settings)
        self.hosts = hosts_of(self.process, self.fleet, settings)

    def order(self, verb: Verb, mode: str) -> None:
        """Order what is in a mode, and ready, to do something: again and again, as a patient operator would."""
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
            known = vehicle.telemetry
            if known.position_m is None or known.attitude is None:
                continue
            mean = (*known.position_m, known.attitude.yaw_rad)
            entities.append(
                EntityEstimate(
                    name=vehicle.name, kind="robot", mean=mean, covariance=_COVARIANCE,
                    velocity_m_s=(0.0, 0.0, 0.0), converged=True, age_s=0.0,
                )
            )  # fmt: skip
            setpoint = VelocitySetpoint(
                header=self.bus.header(vehicle.name), velocity_m_s=(0.4, 0.0, 0.0), yaw_rate_rad_s=0.0,
                lifetime_ms=300, epoch=1,
            )  # fmt: skip
            self.bus.publish(SETPOINT, setpoint)
        self.bus.publish(ESTIMATE, Estimate(header=self.bus.header("team"), entities=tuple(entities), epoch=1))

    def fly(self) -> None:
        for turn in itertools.count():
            now = time.monotonic_ns()
            self.fleet.turn(now)
            for host in self.hosts:
                host.turn(now)
            if turn % 8 == 0:
                self.track()
            if turn % 300 == 0:
                self.order(Verb.TAKEOFF, "LANDED")
                self.order(Verb.TRACK, "HOVER")
                print(*self.process.texts, sep="\n", flush=True)
                self.process.events.clear()
            time.sleep(1 / RATE_HZ)


if __name__ == "__main__":
    Pilot(int(sys.argv[1]), sys.argv[2]).fly()

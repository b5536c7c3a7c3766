"""Cost and delays of driving many vehicles, compared with pymavlink's own receiver on the same frames."""

import math
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from drivers.host import VehicleHost, sleep_serving
from drivers.mavlink.driver import RATE_HZ, Fleet, hosts_of, share_interpreter
from drivers.mavlink.links.seam import Heard, MavlinkLink
from drivers.mavlink.settings import MavlinkDriverSettings
from drivers.mavlink.wire.flight import SetPositionTargetLocalNed
from drivers.mavlink.wire.frames import Message
from drivers.mavlink.wire.telemetry import HighresImu
from groundstation.bench.mavlink_vehicles import AHEAD_M_S, FIRST_SYSTEM
from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Command, EntityEstimate, Estimate, Lease, Severity, VelocitySetpoint, Verb
from groundstation.bus.topics import COMMAND, ESTIMATE, IMU, LEASE, SETPOINT, Topic
from groundstation.errors import DriverError
from groundstation.process.ports import free_port

_START_S = 25.0
_SETTLE_S = 1.0
_SETPOINT_S = 0.05
_APART_M = 5.0  # a vehicle too near to another lands
_STANDING = (1e-4, *(0.0,) * 4, 1e-4, *(0.0,) * 4, 1e-4, *(0.0,) * 4, 1e-4)


class _Host:
    """The process around the driver, reduced to the interface that the driver uses."""

    name, section = "mavlink", "{}"
    stop_requested, supervisor_alive, supervisor_fresh, spoken_for_ns = False, True, True, 0

    def __init__(self, bus: Bus) -> None:
        self.bus: Bus = bus
        self._woken = threading.Event()

    def beat(self) -> None: ...
    def ready(self, detail: str = "") -> None: ...
    def degrade(self, detail: str, works: bool = True) -> None: ...
    def tick_status(self, ticks: int = 0, overruns: int = 0, overflowed: int = 0) -> None: ...
    def note_addresses(self, addresses: Sequence[tuple[str, int]]) -> None: ...
    def finish(self) -> None: ...
    def leave(self, number: int) -> None: ...
    def event(self, severity: Severity | str, text: str, remedy: str = "", entity: str | None = None) -> None: ...
    def sleep_until(self, deadline_ns: int) -> bool:
        """Sleep; never asked to stop."""
        self._woken.wait(max(0, deadline_ns - clock.now_ns()) / 1e9)
        self._woken.clear()
        return True

    def wake(self) -> None:
        """End a sleep early."""
        self._woken.set()


class _TimedBus(MemoryBus):
    """Notes when IMU samples are published; `sent_ns` returns the time of sending of a received frame."""

    def __init__(self, exchange: MemoryExchange) -> None:
        super().__init__(exchange, "lab", "mavlink")
        self.sent_ns: dict[int, int] = {}
        self.late_ms: list[float] = []

    def publish(self, topic: Topic, message: Any) -> None:
        super().publish(topic, message)
        if topic is IMU and (sent := self.sent_ns.pop(message.header.stamp_ns, None)) is not None:
            self.late_ms.append((clock.now_ns() - sent) / 1e6)


class _TimedLink:
    """A link that notes when frames were sent, and the age of each setpoint when it is sent."""

    def __init__(self, link: MavlinkLink, bus: _TimedBus) -> None:
        self.link, self.rejected, self._bus = link, link.rejected, bus
        self.told_ns: dict[int, int] = {}
        self.late_ms: list[float] = []
        self.frames = 0

    @property
    def called_from(self) -> tuple[tuple[str, int], ...]:
        """The last addresses of the vehicles."""
        return self.link.called_from

    @property
    def newest_stamp(self) -> int:
        """Newest time of signing."""
        return self.link.newest_stamp

    def receive(self) -> list[Heard]:
        heard = self.link.receive()
        self.frames += len(heard)
        for stamp_ns, frame in heard:
            if isinstance(frame.message, HighresImu):
                self._bus.sent_ns[stamp_ns] = frame.message.time_usec * 1000
        return heard

    def send(self, system: int, message: Message) -> None:
        self.link.send(system, message)
        if isinstance(message, SetPositionTargetLocalNed) and (told := self.told_ns.pop(system, None)) is not None:
            self.late_ms.append((clock.now_ns() - told) / 1e6)

    def close(self) -> None:
        self.link.close()


class _Tracker(threading.Thread):
    """Publishes estimates and, when asked to, setpoints at 20 Hz, out of step with the driver."""

    def __init__(self, exchange: MemoryExchange, names: Sequence[str], link: _TimedLink) -> None:
        super().__init__(daemon=True)
        self._bus, self._names, self._link = MemoryBus(exchange, "lab", "tracker"), names, link
        self.closing = threading.Event()

    def order(self, verb: Verb) -> None:
        expires_ns, header = clock.now_ns() + 10**10, self._bus.header("team")
        self._bus.publish(LEASE, Lease(header=header, holder="bench", expires_ns=expires_ns))
        self._bus.publish(
            COMMAND, Command(header=header, id=verb, verb=verb, scope=(), issuer="bench", expires_ns=expires_ns)
        )

    def run(self) -> None:
        while not self.closing.wait(_SETPOINT_S * 1.017):
            entities = tuple(
                EntityEstimate(
                    name=name, kind="robot", mean=(0.0, _APART_M * number, 1.0, 0.0), covariance=_STANDING,
                    velocity_m_s=(AHEAD_M_S, 0.0, 0.0), converged=True, age_s=0.0,
                )
                for number, name in enumerate(self._names)
            )  # fmt: skip
            self._bus.publish(ESTIMATE, Estimate(header=self._bus.header("team"), entities=entities, epoch=1))
            for number, name in enumerate(self._names):
                setpoint = VelocitySetpoint(
                    header=self._bus.header(name), velocity_m_s=(AHEAD_M_S, 0.0, 0.0), yaw_rate_rad_s=0.0,
                    lifetime_ms=300, epoch=1,
                )  # fmt: skip
                self._link.told_ns[FIRST_SYSTEM + number] = clock.now_ns()
                self._bus.publish(SETPOINT, setpoint)


def measure(kind: str, count: int, seconds: float) -> dict[str, Any]:
    """Return CPU [cores], delays [ms] and start-up [s] of the driver; raises DriverError when it never flies them."""
    port = free_port(socket.SOCK_DGRAM)
    exchange = MemoryExchange()
    bus = _TimedBus(exchange)
    names = [f"v{n}" for n in range(count)]
    vehicles = [{"name": name, "system_id": FIRST_SYSTEM + n, "flavour": "px4"} for n, name in enumerate(names)]
    settings = MavlinkDriverSettings.model_validate(
        {"link": {"kind": kind, "target": f"udpin:127.0.0.1:{port}"}, "vehicles": vehicles}
    )
    share_interpreter(settings)
    host = _Host(bus)
    fleet = Fleet(host, settings)
    link = _TimedLink(fleet.link, bus)
    fleet.link = link
    for vehicle in fleet.vehicles.values():
        vehicle.use(link)
    tracker = _Tracker(exchange, names, link)
    talking = talk(port, count, _START_S + seconds + 5)
    try:
        return _Flight(host, hosts_of(host, fleet, settings), fleet, tracker).measure(link, bus, seconds)
    finally:
        talking.kill()
        talking.wait()
        tracker.closing.set()
        fleet.close()


class _Flight:
    """Turns the driver while the vehicles take off and follow setpoints, and measures that."""

    def __init__(self, host: _Host, hosts: Sequence[VehicleHost], fleet: Fleet, tracker: _Tracker) -> None:
        self._host, self._hosts, self._fleet, self._tracker = host, hosts, fleet, tracker
        self._begin_ns = self._deadline_ns = clock.now_ns()

    def measure(self, link: _TimedLink, bus: _TimedBus, seconds: float) -> dict[str, Any]:
        """Return the figures of `seconds` in TRACK; raises DriverError if a vehicle does not get or stay there."""
        self._turn_until(lambda: all(v.telemetry.heartbeat_ns for v in self._fleet.vehicles.values()), "heard")
        found_s = (clock.now_ns() - self._begin_ns) / 1e9
        self._tracker.start()
        for mode, verb in (("LANDED", Verb.TAKEOFF), ("HOVER", Verb.TRACK)):
            self._reach(mode)
            self._tracker.order(verb)
        self._reach("TRACK")
        self._turn_for(_SETTLE_S)
        link.late_ms.clear()
        bus.late_ms.clear()
        begin_ns, cpu_s, frames = clock.now_ns(), time.process_time(), link.frames
        self._turn_for(seconds)
        elapsed_s, cpu_s, frames = (clock.now_ns() - begin_ns) / 1e9, time.process_time() - cpu_s, link.frames - frames
        if fallen := [each.watchdog for each in self._hosts if each.watchdog.mode != "TRACK"]:
            raise DriverError(f"a vehicle left TRACK while it was measured: {fallen[0].reason}")
        return {
            "discovery_s": round(found_s, 2),
            "cores": round(cpu_s / elapsed_s, 3),
            "frames_per_s": round(frames / elapsed_s),
            "us_per_frame": round(1e6 * cpu_s / max(1, frames), 1),
            "telemetry_to_bus_ms": quantiles(bus.late_ms),
            "setpoint_to_wire_ms": quantiles(link.late_ms),
        }

    def _reach(self, mode: str) -> None:
        dogs = [each.watchdog for each in self._hosts]
        self._turn_until(lambda: all(dog.mode == mode and not dog.vehicle.not_ready for dog in dogs), f"in {mode}")

    def _turn_until(self, reached: Callable[[], bool], what: str) -> None:
        while not reached():
            if clock.now_ns() - self._begin_ns > _START_S * 1e9:
                raise DriverError(f"the vehicles are not {what}: {self._hosts[0].watchdog.vehicle.not_ready}")
            self._turn()

    def _turn_for(self, seconds: float) -> None:
        end_ns = clock.now_ns() + round(seconds * 1e9)
        while clock.now_ns() < end_ns:
            self._turn()

    def _turn(self) -> None:
        now_ns = clock.now_ns()
        self._fleet.turn(now_ns)
        for each in self._hosts:
            each.turn(now_ns)
        self._deadline_ns = max(self._deadline_ns + round(1e9 / RATE_HZ), now_ns)
        sleep_serving(self._host, self._hosts, self._deadline_ns)


def peer(count: int, seconds: float) -> dict[str, float]:
    """Return the CPU time of pymavlink's mavutil to receive the same frames without using them."""
    os.environ["MAVLINK20"] = "1"
    from pymavlink import mavutil

    port = free_port(socket.SOCK_DGRAM)
    connection = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}")
    talking = talk(port, count, seconds + 5)
    try:
        connection.recv_match(blocking=True, timeout=5)
        begin, cpu, frames = time.monotonic(), time.process_time(), 0
        while time.monotonic() - begin < seconds:
            frames += connection.recv_match(blocking=True, timeout=0.5) is not None
        cpu = time.process_time() - cpu
    finally:
        talking.kill()
        talking.wait()
        connection.close()
    return {"us_per_frame": round(1e6 * cpu / max(1, frames), 1), "cores": round(cpu / seconds, 3)}


def talk(port: int, count: int, seconds: float) -> "subprocess.Popen[bytes]":
    """Start the sending vehicles."""
    module = [sys.executable, "-m", "groundstation.bench.mavlink_vehicles"]
    return subprocess.Popen([*module, str(port), str(count), str(seconds)])


def quantiles(late_ms: list[float]) -> dict[str, float]:
    """Return median and 99th percentile."""
    ordered = sorted(late_ms) or [math.nan]
    return {"p50": round(ordered[len(ordered) // 2], 2), "p99": round(ordered[int(len(ordered) * 0.99)], 2)}

"""One unmodified firmware in the room: its process, its driver, and its connection to the study."""

import math
import signal
import sys
import time
from collections import deque
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "contract")]  # for the helper modules of this folder
from firmware import Firmware, ports_of  # noqa: E402
from mavlink_process import FakeProcess  # noqa: E402

from drivers.mavlink.driver import Fleet, hosts_of  # noqa: E402
from drivers.mavlink.parameters import needed  # noqa: E402
from drivers.mavlink.settings import MavlinkDriverSettings  # noqa: E402
from drivers.mavlink.wire.names import Flavour  # noqa: E402
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange  # noqa: E402
from groundstation.bus.messages import Command, Estimate, Lease, Odometry, VehicleStatus, VelocitySetpoint, Verb  # noqa: E402
from groundstation.bus.topics import COMMAND, ESTIMATE, LEASE, ODOMETRY, SETPOINT, VEHICLE_STATUS  # noqa: E402
from groundstation.settings.sections import driver_sections  # noqa: E402
from sim_bridge.real.mavlink_truth import AutopilotTruth  # noqa: E402
from sim_bridge.real.placed import Placement  # noqa: E402
from sim_bridge.study.runner import CLOCK, Study  # noqa: E402

# Twice its period: on a loaded machine the thread that sends the true pose lags behind a firmware's other threads.
TRUTH_NS = 80_000_000


class Lean:
    """Attitude telemetry for a drone's camera."""

    def __init__(self, vehicle: Any) -> None:
        self._vehicle = vehicle

    @property
    def roll(self) -> float:
        attitude = self._vehicle.telemetry.attitude
        return 0.0 if attitude is None else float(attitude.roll_rad)

    @property
    def pitch(self) -> float:
        attitude = self._vehicle.telemetry.attitude
        return 0.0 if attitude is None else float(attitude.pitch_rad)


class Seat:
    """A drone of the field flown by a firmware. Its process runs until it is `stop`ped; `take_seat` gives it a driver.

    heard_ns: its own time at its last message; zero_ns: the room's time less its own; killed: its driver is dead.
    """

    def __init__(self, name: str, flavour: str, system: int, folder: Path, speed: float) -> None:
        self.name, self.flavour, self.system = name, flavour, system
        folder.mkdir(exist_ok=True)
        wanted = {one.name: one.value for one in needed(Flavour[flavour.upper()], 255)}
        self.firmware = Firmware(flavour, folder, system, wanted, speed)
        self.heard_ns = self.zero_ns = self._truth_ns = self._orders = 0
        self.killed = self.flying = False
        self._newest: deque[Odometry] = deque()
        self._status: VehicleStatus | None = None

    @property
    def settings(self) -> dict[str, Any]:
        """Return the field settings of its link: it calls a port of this computer."""
        return {
            "flavour": self.flavour, "system_id": self.system, "link": "pymavlink",
            "listen": True, "local_address": "127.0.0.1", "port": ports_of(self.flavour, self.system)[0],
        }  # fmt: skip

    def take_seat(self, study: Study, field: Any) -> None:
        """Start its driver, and add it to the study."""
        self.drone = study.site.drones[self.name]
        section = next(one.section for one in driver_sections(field) if one.name == self.name)
        settings = MavlinkDriverSettings.model_validate_json(section)
        exchange = MemoryExchange()
        self.bus = MemoryBus(exchange, "lab", "tracker")
        self.process = FakeProcess(MemoryBus(exchange, "lab", self.name))
        self._odometry, self._statuses = self.bus.subscribe([ODOMETRY]), self.bus.subscribe([VEHICLE_STATUS])
        self.fleet = Fleet(self.process, settings)
        (self.host,) = hosts_of(self.process, self.fleet, settings)
        self.vehicle = self.fleet.vehicles[self.system]
        self.vehicle.take = self._note_time(self.vehicle.take)  # type: ignore[method-assign]
        where = ("127.0.0.1", ports_of(self.flavour, self.system)[1])
        self.truth = AutopilotTruth(self.name, where, self.system, Placement(self.drone.pad_m, self.drone.pad_yaw_rad))
        self.puppet = study.world.puppets[self.name]
        study.attach(self.name, self)
        study.world.onboard[self.name] = Lean(self.vehicle)

    def _note_time(self, hear: Any) -> Any:
        def noted(heard: Any) -> None:
            message = heard.frame.message
            stamp_us = getattr(message, "time_usec", 0) or 1000 * getattr(message, "time_boot_ms", 0)
            if heard.frame.component == 1 and stamp_us:
                self.heard_ns = max(self.heard_ns, 1000 * stamp_us)
            if not self.killed:
                hear(heard)

        return noted

    # -- the study's link ---------------------------------------------------------------------------------------------

    def obey(self, velocity: tuple[float, float, float], yaw_rate: float, now_s: float) -> None:
        """Accept a setpoint of the tracker; while the study hovers, only setpoints that hold its place arrive."""
        header, holds = self.bus.header(self.name), self.mode in ("HOVER", "HOLD")
        setpoint = VelocitySetpoint(
            header=header, velocity_m_s=velocity, yaw_rate_rad_s=yaw_rate, lifetime_ms=300, epoch=1, holds=holds
        )
        self.bus.publish(SETPOINT, setpoint)

    def step(self, now_s: float, estimates: Any) -> None:
        """Do nothing: the driver has its own turns."""

    def odometry(self, stamp_ns: int) -> Odometry | None:
        """Return the driver's oldest odometry not yet fetched."""
        return self._newest.popleft() if self._newest else None

    def status(self, stamp_ns: int, _mode: str) -> VehicleStatus:
        """Return the driver's last status."""
        assert self._status is not None
        return self._status

    # -- time ---------------------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Resume its process; one that ended by itself stays ended."""
        self.firmware.process.send_signal(signal.SIGCONT)

    def stop(self) -> None:
        """Suspend its process."""
        self.firmware.process.send_signal(signal.SIGSTOP)

    def ahead_ns(self, now_ns: int) -> int:
        """Return how long it flew on after a time of the room."""
        return self.heard_ns + self.zero_ns - now_ns

    def lags(self, now_ns: int) -> bool:
        """Return whether it has not reached a time of the room yet, its true pose included."""
        assert self.firmware.process.poll() is None, "the firmware ended by itself"
        if self.ahead_ns(now_ns) < 0:
            return True
        self.follow_truth()
        return self.flying and self.heard_ns - self._truth_ns > TRUTH_NS

    def follow_truth(self) -> None:
        """Move its body in the room to its simulator's pose."""
        if (pose := self.truth.latest(time.monotonic_ns())) is not None:
            self.puppet.follow(pose)
            self._truth_ns = self.heard_ns

    def drive(self, now_ns: int) -> None:
        """Run one turn of its driver."""
        if not self.killed:
            self.fleet.turn(now_ns)
            self.host.turn(now_ns)
        for received in self._odometry.drain():
            self._newest.append(_on_study_clock(received.message))
        for received in self._statuses.drain():
            self._status = _on_study_clock(received.message)
        if not self.flying:
            self._newest.clear()

    # -- input from the room ------------------------------------------------------------------------------------------

    @property
    def mode(self) -> str:
        """Return the driver's mode."""
        return str(self.host.watchdog.mode)

    def tell(self, entities: tuple[Any, ...]) -> None:
        """Send the tracker's estimate to its driver."""
        self.bus.publish(ESTIMATE, Estimate(header=self.bus.header("team"), entities=entities, epoch=1))

    def order(self, verb: Verb, now_ns: int) -> None:
        """Send an operator's command to its driver."""
        header, self._orders = self.bus.header("team"), self._orders + 1
        expires_ns = now_ns + 10**10
        self.bus.publish(LEASE, Lease(header=header, holder="op", expires_ns=expires_ns))
        command = Command(
            header=header, id=f"c{self._orders}", verb=verb, scope=(self.name,), issuer="op", expires_ns=expires_ns
        )
        self.bus.publish(COMMAND, command)

    def row(self, believed: Any, now_ns: int) -> dict[str, Any]:
        """Return the current differences between its true motion, its telemetry and the belief."""
        body, known = self.puppet.airframe, self.vehicle.telemetry
        c, s = math.cos(body.yaw), math.sin(body.yaw)
        forward, left, up = known.velocity_m_s
        row = {
            "name": self.name, "mode": self.mode, "true": (body.x, body.y, body.z),
            "v": (body.vx, body.vy, body.vz), "tilt": (body.roll, body.pitch),
            "own_v_error": (c * forward - s * left - body.vx, s * forward + c * left - body.vy, up - body.vz),
            "own_error": np.subtract(known.position_m or (math.nan,) * 3, (body.x, body.y, body.z)).tolist(),
            "drift": self.vehicle.orders.drift.drift(now_ns), "why": self.host.watchdog.reason,
            "armed": known.base_mode >> 7, "px_mode": known.custom_mode, "landed": known.landed,
        }  # fmt: skip
        if known.attitude is not None:
            row["tilt_error"] = (known.attitude.roll_rad - body.roll, known.attitude.pitch_rad - body.pitch)
        if believed is not None:
            row |= {"belief_error": np.subtract(believed.mean[:3], (body.x, body.y, body.z)).tolist()}
            row |= {"belief_vz_error": believed.velocity_m_s[2] - body.vz}
            row |= {"std": (believed.covariance[0] ** 0.5, believed.covariance[5] ** 0.5), "age": believed.age_s}
        return row

    def close(self) -> None:
        """End driver and firmware."""
        self.run()
        self.fleet.close()
        self.truth.close()
        self.firmware.end()


def _on_study_clock(message: Any) -> Any:
    header = msgspec.structs.replace(message.header, clock=CLOCK)
    return msgspec.structs.replace(message, header=header)

"""A firmware of its own as one drone of the mixed team, at message level and in step with it.

Cameras, target and the other drones are those of the study; driver, tracker and firmware are the real ones. The
firmware's process is stopped while the room computes, and goes on for 10 ms of its own time at a time: a loaded machine
makes the flight slower.
"""

import json
import math
import os
import signal
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "contract")]  # what lies here and is no test belongs to these tests
from firmware import Firmware, ports_of  # noqa: E402
from mavlink_process import FakeProcess  # noqa: E402

from drivers.mavlink.driver import Fleet, hosts_of  # noqa: E402
from drivers.mavlink.parameters import needed  # noqa: E402
from drivers.mavlink.settings import MavlinkDriverSettings  # noqa: E402
from drivers.mavlink.wire.names import Flavour  # noqa: E402
from groundstation.bus import clock  # noqa: E402
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange  # noqa: E402
from groundstation.bus.messages import Command, Estimate, Lease, Odometry, VehicleStatus, VelocitySetpoint, Verb  # noqa: E402
from groundstation.bus.topics import COMMAND, ESTIMATE, LEASE, ODOMETRY, SETPOINT, VEHICLE_STATUS  # noqa: E402
from groundstation.settings.load import load_field  # noqa: E402
from groundstation.settings.resolved import resolved_field  # noqa: E402
from groundstation.settings.sections import driver_sections  # noqa: E402
from sim_bridge.real.mavlink_truth import AutopilotTruth  # noqa: E402
from sim_bridge.real.placed import Placement  # noqa: E402
from sim_bridge.scenario import Scenario  # noqa: E402
from sim_bridge.study.runner import CLOCK, Study, StudyOptions  # noqa: E402
from sim_bridge.world.world import TICK_NS  # noqa: E402

NAME = "drone_2"
MIXED_TEAM = HERE.parents[1] / "config" / "mixed-team.yaml"
SLICE_NS, ESTIMATE_NS = 10_000_000, 20_000_000
READY_S, SILENT_S = 120.0, 20.0
# Twice its period: on a loaded machine the thread that sends the true pose lags behind the others of a firmware.
TRUTH_NS = 80_000_000


def field_with(flavour: str, system: int, port: int) -> Any:
    """Return the mixed team with one drone of a flavour that calls a port of this computer."""
    mavlink = {
        "flavour": flavour, "system_id": system, "link": "pymavlink",
        "listen": True, "local_address": "127.0.0.1", "port": port,
    }  # fmt: skip
    return load_field(
        MIXED_TEAM, [f"drones.{NAME}.mavlink.{key}={json.dumps(value)}" for key, value in mavlink.items()]
    )


class FirmwareStudy(Study):
    """The study on the firmware's clock; blind: nobody sees the real drone, and its own camera shows nothing."""

    start_ns = 0
    blind = False

    @property
    def now_ns(self) -> int:
        return self.start_ns + self.world.ticks * TICK_NS

    def _send(self, arrival_ns: int, key: str, message: Any) -> None:
        if self.blind and NAME in (getattr(message, "observer", ""), getattr(message, "subject", "")):
            return
        super()._send(arrival_ns, key, message)


class Lean:
    """What the camera of a drone is told of its attitude."""

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


class Room:
    """One flight. `slice` is 10 ms of it; `until` goes on until a condition holds; `close` ends the firmware.

    alone_s: for how long the firmware flew on at most while this process waited for the processor. Its clock is slower
    than the real one, so that such a pause is short for it.
    """

    def __init__(self, flavour: str, seed: int, folder: Path, system: int = 8, speed: float = 0.5) -> None:
        self.flavour, self.system = flavour, system
        wanted = {one.name: one.value for one in needed(Flavour[flavour.upper()], 255)}
        self.firmware = Firmware(flavour, folder, system, wanted, speed)
        try:
            self._build(flavour, seed)
        except BaseException:
            self.firmware.end()
            raise

    def _build(self, flavour: str, seed: int) -> None:
        port, truth_port = ports_of(flavour, self.system)
        field = field_with(flavour, self.system, port)
        options = StudyOptions(seed, take_off_s=math.inf)
        self.study = FirmwareStudy(resolved_field(field), Scenario(), options, real=[NAME])
        self.drone = self.study.site.drones[NAME]
        section = next(one.section for one in driver_sections(field) if one.name == NAME)
        settings = MavlinkDriverSettings.model_validate_json(section)
        exchange = MemoryExchange()
        self.bus = MemoryBus(exchange, "lab", "tracker")
        self.process = FakeProcess(MemoryBus(exchange, "lab", NAME))
        self._odometry, self._statuses = self.bus.subscribe([ODOMETRY]), self.bus.subscribe([VEHICLE_STATUS])
        self.fleet = Fleet(self.process, settings)
        (self.host,) = hosts_of(self.process, self.fleet, settings)
        self.vehicle = self.fleet.vehicles[self.system]
        self.firmware_ns, self.killed = 0, False
        self.vehicle.hear = self._note_time(self.vehicle.hear)  # type: ignore[method-assign]
        self.truth = AutopilotTruth(
            NAME, ("127.0.0.1", truth_port), self.system, Placement(self.drone.pad_m, self.drone.pad_yaw_rad)
        )
        self.puppet = self.study.world.puppets[NAME]
        self.study.attach(NAME, self)
        self.study.world.onboard[NAME] = Lean(self.vehicle)
        self._zero_ns = self._now_ns = self._next_estimate_ns = self.orders = self._truth_ns = 0
        self.alone_s = 0.0
        self.flying = False
        self.trace: list[dict[str, Any]] = []
        self._newest: deque[Odometry] = deque()
        self._status: VehicleStatus | None = None

    def _note_time(self, hear: Any) -> Any:
        def noted(heard: Any) -> None:
            message = heard.frame.message
            stamp_us = getattr(message, "time_usec", 0) or 1000 * getattr(message, "time_boot_ms", 0)
            if heard.frame.component == 1 and stamp_us:
                self.firmware_ns = max(self.firmware_ns, 1000 * stamp_us)
            if not self.killed:
                hear(heard)

        return noted

    # -- the link that the study sees ---------------------------------------------------------------------------------

    def obey(self, velocity: tuple[float, float, float], yaw_rate: float, now_s: float) -> None:
        """Take a setpoint of the tracker."""
        header = self.bus.header(NAME)
        setpoint = VelocitySetpoint(
            header=header, velocity_m_s=velocity, yaw_rate_rad_s=yaw_rate, lifetime_ms=300, epoch=1
        )
        self.bus.publish(SETPOINT, setpoint)

    def step(self, now_s: float, estimates: Any) -> None:
        """Do nothing: the driver has turns of its own."""

    def odometry(self, stamp_ns: int) -> Odometry | None:
        """Return the driver's oldest reading that was not asked for yet."""
        return self._newest.popleft() if self._newest else None

    def status(self, stamp_ns: int) -> VehicleStatus:
        """Return the driver's last word."""
        assert self._status is not None
        return self._status

    def _collect(self) -> None:
        for received in self._odometry.drain():
            self._newest.append(_on_study_clock(received.message))
        for received in self._statuses.drain():
            self._status = _on_study_clock(received.message)
        if not self.flying:
            self._newest.clear()

    # -- time ---------------------------------------------------------------------------------------------------------

    @contextmanager
    def clocked(self) -> Iterator[None]:
        """Have everything here read the firmware's clock."""
        old, clock.now_ns = clock.now_ns, self._clock
        try:
            yield
        finally:
            clock.now_ns = old

    def _clock(self) -> int:
        return self._now_ns or time.monotonic_ns()

    def slice(self) -> None:
        """Let 10 ms pass for everybody."""
        self._let_firmware_run()
        self._follow_truth()
        if self.flying:
            for _ in range(SLICE_NS // TICK_NS):
                self.study.step()
        now_ns = self._clock()
        if now_ns >= self._next_estimate_ns:
            self._next_estimate_ns = now_ns + ESTIMATE_NS
            entities = tuple(self.study.tracker.estimates())
            self.bus.publish(ESTIMATE, Estimate(header=self.bus.header("team"), entities=entities, epoch=1))
        if not self.killed:
            self.fleet.turn(now_ns)
            self.host.turn(now_ns)
        self._collect()
        if self.flying and self.study.world.ticks % 20 == 0:
            self.trace.append(self._row())

    def _follow_truth(self) -> None:
        if (pose := self.truth.latest(time.monotonic_ns())) is not None:
            self.puppet.follow(pose)
            self._truth_ns = self.firmware_ns

    def _lags(self, due_ns: int) -> bool:
        if self.firmware_ns < due_ns:
            return True
        self._follow_truth()
        return self.flying and self.firmware_ns - self._truth_ns > TRUTH_NS

    def _row(self) -> dict[str, Any]:
        """Return how its true motion, its own word and the belief differ now."""
        body, known = self.puppet.airframe, self.vehicle.telemetry
        believed = next((one for one in self.study.tracker.estimates() if one.name == NAME), None)
        c, s = math.cos(body.yaw), math.sin(body.yaw)
        forward, left, up = known.velocity_m_s
        row = {
            "t": self.study.world.time_s, "mode": self.mode, "true": (body.x, body.y, body.z),
            "v": (body.vx, body.vy, body.vz), "tilt": (body.roll, body.pitch),
            "own_v_error": (c * forward - s * left - body.vx, s * forward + c * left - body.vy, up - body.vz),
            "own_error": np.subtract(known.position_m or (math.nan,) * 3, (body.x, body.y, body.z)).tolist(),
            "drift": self.vehicle.orders.drift.drift(self._clock()), "why": self.host.watchdog.reason,
            "armed": known.base_mode >> 7, "px_mode": known.custom_mode, "landed": known.landed,
        }  # fmt: skip
        if known.attitude is not None:
            row["tilt_error"] = (known.attitude.roll_rad - body.roll, known.attitude.pitch_rad - body.pitch)
        if believed is not None:
            row |= {"belief_error": np.subtract(believed.mean[:3], (body.x, body.y, body.z)).tolist()}
            row |= {"belief_vz_error": believed.velocity_m_s[2] - body.vz}
            row |= {"std": (believed.covariance[0] ** 0.5, believed.covariance[5] ** 0.5), "age": believed.age_s}
        return row

    def _let_firmware_run(self) -> None:
        if not self._zero_ns:
            time.sleep(SLICE_NS / 1e9)
            if self.firmware_ns:
                self._now_ns = time.monotonic_ns()
                self._zero_ns = self._now_ns - self.firmware_ns
            return
        self._now_ns += SLICE_NS
        due_ns, deadline = self._now_ns - self._zero_ns, time.monotonic() + SILENT_S
        if not self._lags(due_ns):
            return
        os.kill(self.firmware.process.pid, signal.SIGCONT)
        while self._lags(due_ns):
            time.sleep(0.0005)
            assert self.firmware.process.poll() is None, "the firmware ended by itself"
            assert time.monotonic() < deadline, "the firmware's clock stands still"
        os.kill(self.firmware.process.pid, signal.SIGSTOP)
        if self.flying:
            self.alone_s = max(self.alone_s, (self.firmware_ns - due_ns) / 1e9)

    def until(self, condition: Any, limit_s: float, verb: Verb | None = None, mode: str = "") -> bool:
        """Let time pass until a condition holds, ordering it twice a second; returns whether it did in time."""
        end_ns = self._clock() + round(limit_s * 1e9)
        next_ns = 0
        while not condition():
            now_ns = self._clock()
            if now_ns > end_ns:
                return False
            if verb is not None and now_ns >= next_ns and self.host.watchdog.mode == mode:
                next_ns = now_ns + 500_000_000
                self._order(verb)
            self.slice()
        return True

    def _order(self, verb: Verb) -> None:
        header, self.orders = self.bus.header("team"), self.orders + 1
        expires_ns = self._clock() + 10**10
        self.bus.publish(LEASE, Lease(header=header, holder="op", expires_ns=expires_ns))
        command = Command(
            header=header, id=f"c{self.orders}", verb=verb, scope=(NAME,), issuer="op", expires_ns=expires_ns
        )
        self.bus.publish(COMMAND, command)

    # -- the flight ---------------------------------------------------------------------------------------------------

    @property
    def mode(self) -> str:
        """Return what the driver is about."""
        return str(self.host.watchdog.mode)

    def get_ready(self) -> None:
        """Wait on the pad until the vehicle may take off."""
        watchdog = self.host.watchdog
        ready = self.until(lambda: watchdog.mode == "LANDED" and not watchdog.vehicle.not_ready, READY_S)
        assert ready, f"{watchdog.mode}: {watchdog.vehicle.not_ready}; {self.process.texts[-6:]}"
        assert self._zero_ns and self.puppet.poses, "neither its time nor its true pose is heard"
        self.until(lambda: False, 1.0)

    def close(self) -> None:
        """End driver and firmware."""
        os.kill(self.firmware.process.pid, signal.SIGCONT)
        self.fleet.close()
        self.truth.close()
        self.firmware.end()


def _on_study_clock(message: Any) -> Any:
    header = msgspec.structs.replace(message.header, clock=CLOCK)
    return msgspec.structs.replace(message, header=header)

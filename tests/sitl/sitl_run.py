"""A real `groundstation sitl` process: observed over the bus, disturbed, and judged by ground truth."""

import json
import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from groundstation.bus.api import Received
from groundstation.bus.messages import Event, Message, ProcessStatus, TruthState, VehicleStatus
from groundstation.bus.roles import Role
from groundstation.bus.topics import EVENT, PROCESS_STATUS, SETPOINT, TRUTH, VEHICLE_STATUS
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.supervisor import runtime_file
from groundstation.supervisor.joining import join

COMMAND = (sys.executable, "-m", "groundstation")
FEW_PICTURES = Path(__file__).parents[1] / "fixtures" / "few_pictures.yaml"


class SitlRun:
    """One run. `history` holds (time of arrival [s], message) by (topic, entity); `text` is its output."""

    def __init__(
        self, folder: Path, *arguments: str, terminal: int | None = None, program: tuple[str, ...] = COMMAND
    ) -> None:
        self.folder = folder
        self.output = folder / "output.txt"
        report = () if "--output" in arguments else ("--output", str(folder))
        scenario = () if "--scenario" in arguments else ("--scenario", str(FEW_PICTURES))
        screen = ("--headless",) if terminal is None else ()
        command = [*program, *arguments, *screen, *report, *scenario]
        with self.output.open("wb") as sink:
            self.process = subprocess.Popen(
                # With a terminal, `setsid --ctty` makes it the run's own: closing it sends a hang-up.
                command if terminal is None else ["setsid", "--ctty", *command],
                stdin=subprocess.DEVNULL if terminal is None else terminal,
                stdout=sink if terminal is None else terminal,
                stderr=subprocess.STDOUT,
                cwd=folder,
                start_new_session=terminal is None,
            )
        self.history: defaultdict[tuple[str, str], list[tuple[float, Message]]] = defaultdict(list)
        self._bus: ZenohBus | None = None
        self._pids: dict[int, int] = {}
        try:
            self.record = self._find_record()
        except BaseException:  # nobody else knows of it yet: if it flew on, it would take the processor from all others
            self.close()
            raise

    def _find_record(self, limit_s: float = 120.0) -> runtime_file.RuntimeRecord:
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            for record in runtime_file.live_records():
                if record.supervisor.pid == self.process.pid:
                    self._bus = join(record, "view", Role.VIEW, timeout_s=10.0)
                    topics = (VEHICLE_STATUS, PROCESS_STATUS, EVENT, TRUTH, SETPOINT)
                    self._inbox = self._bus.subscribe(topics, capacity=100_000)
                    return record
            assert self.process.poll() is None, self.text
            time.sleep(0.05)
        raise AssertionError(f"the run never appeared:\n{self.text}")

    @property
    def text(self) -> str:
        return self.output.read_text(errors="replace")

    @property
    def run_dir(self) -> Path:
        return Path(self.record.run_dir)

    def listen(self) -> None:
        """Read the messages from the bus."""
        now = time.monotonic()
        for received in self._inbox.drain():
            self._note(received, now)
        for record in runtime_file.live_records():
            if record.supervisor.pid == self.process.pid:
                self._pids |= {p.pid: p.start_time for p in (record.supervisor, *record.processes)}
                self.record = record

    def _note(self, received: Received, now: float) -> None:
        if received.message is not None:
            self.history[received.key.topic.name, received.key.entity].append((now, received.message))

    def until(self, condition: Callable[[], bool], limit_s: float, what: str = "condition") -> float:
        """Wait for a condition; returns the time [s]."""
        deadline = time.monotonic() + limit_s
        while True:
            self.listen()
            if condition():
                return time.monotonic()
            assert time.monotonic() < deadline, f"never: {what}\n{self.text}"
            assert self.process.poll() is None or limit_s < 1, f"ended before: {what}\n{self.text}"
            time.sleep(0.02)

    def status(self, drone: str) -> VehicleStatus | None:
        heard = self.history[VEHICLE_STATUS.name, drone]
        message = heard[-1][1] if heard else None
        return message if isinstance(message, VehicleStatus) else None

    def mode(self, drone: str) -> str:
        status = self.status(drone)
        return status.mode if status else ""

    def modes_since(self, drone: str, since: float) -> list[str]:
        heard = self.history[VEHICLE_STATUS.name, drone]
        return [message.mode for at, message in heard if at > since and isinstance(message, VehicleStatus)]

    def truth(self, body: str) -> list[tuple[float, TruthState]]:
        """Return (time of arrival [s], state) of a body; for judging only."""
        return [(at, m) for at, m in self.history[TRUTH.name, body] if isinstance(m, TruthState)]

    def height(self, body: str) -> float:
        known = self.truth(body)
        return known[-1][1].position_m[2] if known else 0.0

    def speed_between(self, body: str, start: float, end: float) -> float:
        """Return the highest horizontal speed in a span of time [m/s]."""
        speeds = [
            (s.velocity_m_s[0] ** 2 + s.velocity_m_s[1] ** 2) ** 0.5 for at, s in self.truth(body) if start <= at <= end
        ]
        return max(speeds, default=0.0)

    def on_ground(self, body: str) -> bool:
        known = self.truth(body)
        return bool(known) and known[-1][1].on_ground

    def pid(self, name: str) -> int:
        """Return the pid of a process from the runtime file."""
        self.listen()
        return next(process.pid for process in self.record.processes if process.name == name)

    def restarted(self, name: str, former_pid: int) -> bool:
        heard = self.history[PROCESS_STATUS.name, name]
        message = heard[-1][1] if heard else None
        return isinstance(message, ProcessStatus) and message.pid != former_pid and message.state == "READY"

    def address(self, drone: str) -> str:
        """Return the address of a drone's emulator."""
        order = json.loads((self.run_dir / "sim_bridge.json").read_text())
        return str(order["addresses"][drone])

    def events(self) -> list[str]:
        """Return all events as "SEVERITY entity: text"."""
        heard = [entry for (topic, _), entries in self.history.items() if topic == EVENT.name for entry in entries]
        heard.sort(key=lambda entry: entry[0])
        return [f"{m.severity} {m.header.entity}: {m.text}" for _, m in heard if isinstance(m, Event)]

    def until_tracking(self, limit_s: float = 90.0) -> float:
        """Wait until every drone tracks."""
        drones = self.record.drones
        return self.until(lambda: all(self.mode(name) == "TRACK" for name in drones), limit_s, "all in TRACK")

    def until_landed(self, limit_s: float = 30.0) -> float:
        """Wait until every drone is on the ground by the truth."""
        drones = self.record.drones
        return self.until(lambda: all(self.on_ground(name) for name in drones), limit_s, "all on the ground")

    def wait(self, limit_s: float = 60.0) -> int:
        """Wait for the end of the command; returns its exit code."""
        deadline = time.monotonic() + limit_s
        while self.process.poll() is None:
            self.listen()
            assert time.monotonic() < deadline, f"did not end\n{self.text}"
            time.sleep(0.05)
        return self.process.returncode

    def survivors(self) -> list[int]:
        """Return the pids of this run that still live."""
        return [pid for pid, started in self._pids.items() if runtime_file.start_time(pid) == started]

    def until_gone(self, limit_s: float = 30.0) -> None:
        """Wait until no process of the run is left."""
        deadline = time.monotonic() + limit_s
        while self.survivors():
            assert time.monotonic() < deadline, f"orphans: {self.survivors()}"
            time.sleep(0.05)

    def close(self) -> None:
        """End all remaining processes of the run."""
        for number, patience_s in ((signal.SIGTERM, 40), (signal.SIGTERM, 10), (signal.SIGKILL, 5)):
            if self.process.poll() is not None:
                break
            self.process.send_signal(number)
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(patience_s)
        if self._bus is not None:
            self._bus.close()
        for pid in self.survivors():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
                os.kill(pid, signal.SIGKILL)

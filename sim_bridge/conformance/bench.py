"""One flight of the kit: room, bus, driver and its peers, with the verbs that scripts use."""

import importlib
import os
import signal
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from groundstation.adapters import UdpSender
from groundstation.bus.messages import AckStage, Verb
from groundstation.bus.topics import COMMAND_ACK, EVENT, PROCESS_STATUS, VEHICLE_STATUS
from groundstation.bus.zenoh_bus import open_bus, open_router
from groundstation.process.child import ChildSpec
from groundstation.process.heartbeat import HeartbeatBlock
from groundstation.process.ports import free_port
from groundstation.vehicles import StopDatagrams
from sim_bridge.conformance.driver_process import DriverLife
from sim_bridge.conformance.record import Moment, Record
from sim_bridge.conformance.room import Room
from sim_bridge.conformance.subject import NAME, SITE, Subject
from sim_bridge.conformance.upstream import Upstream
from sim_bridge.fault_kinds import Fault
from sim_bridge.world.emulation import Emulator

_GUARDIAN = 3
_SLOT = 1


class FlightFailed(Exception):
    """A flight ended before the point where its checks begin."""


class Bench:
    """A context in which one vehicle of the kit flies; its messages and motion go into `record`."""

    def __init__(self, subject: Subject, faults: Iterable[Fault] = ()) -> None:
        self.subject, self.record = subject, Record()
        self._folder = tempfile.TemporaryDirectory(prefix="conformance-")
        self._log = Path(self._folder.name) / "driver.log"
        self._lives: list[DriverLife] = []
        self._failsafe: Any = None
        self.room = Room(subject.launch(faults), self.record)
        self._endpoint = f"tcp/127.0.0.1:{free_port()}"
        self._router = open_router(self._endpoint)
        self._buses = [open_bus(self._endpoint, SITE, name) for name in ("kit", "stranger")]
        self._block = HeartbeatBlock.create(f"skein-conformance-{os.getpid()}-{id(self)}", 4)
        self.up = Upstream(self._buses[0], self._buses[1], self._block, self.record)

    def __enter__(self) -> Self:
        self.room.__enter__()
        self.up.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for life in self._lives:
            life.close()
        if self._failsafe is not None:
            self._failsafe.close()
        self.up.close()
        self.room.__exit__()
        for bus in self._buses:
            bus.close()
        self._router.close()
        self._block.close(remove=True)
        self.record.log = self._log.read_text(errors="replace") if self._log.exists() else ""
        self._folder.cleanup()

    # -- the driver's process -----------------------------------------------------------------------------------------

    def start_driver(self) -> DriverLife:
        """Start the driver, or start it again; its stop datagrams are prepared first, as in a run."""
        if self._failsafe is None:
            self._failsafe = _open(self.subject.kind.stop([self.subject.order()]))
        kind, process = self.subject.kind, self.subject.kind.processes([self.subject.order()])[0]
        self._block.clear(_SLOT)
        spec = ChildSpec(NAME, "driver", self._endpoint, SITE, str(self._block.path), _SLOT)
        self._lives.append(DriverLife(kind.driver, process, spec, self._log))
        return self._lives[-1]

    @property
    def driver(self) -> DriverLife:
        """Return the driver's present process."""
        return self._lives[-1]

    def await_exit(self, limit_s: float) -> None:
        """Wait for the driver's end and note its exit code; None if it does not end in time."""
        ended = self.wait(lambda: not self.driver.alive, limit_s, must=False)
        self.record.exits.append(self.driver.exit_code if ended else None)
        self.record.facts["finished"] = float(self._block.has_ended(_SLOT))

    @contextmanager
    def failsafe(self) -> Iterator[Callable[[str], None]]:
        """Yield a function that sends "hover" or "land" for a dead driver, as supervisor and guardian do."""
        stop = self.subject.kind.stop([self.subject.order()])
        addresses = self._block.addresses(_SLOT) if stop.called else ((self.subject.address, stop.port),)

        def say(word: str) -> None:
            with suppress(OSError):  # a lost link is no error there either: the datagrams are repeated
                self._failsafe.send(stop.hover if word == "hover" else stop.land, addresses)

        yield say

    def speak(self, word: str, seconds: float) -> None:
        """Send "hover" or "land" for a dead driver, ten times a second for a while."""
        with self.failsafe() as say, self.mark(f"told to {word}"):
            for _ in range(round(10 * seconds)):
                say(word)
                time.sleep(0.1)

    # -- conditions that a script waits for ---------------------------------------------------------------------------

    @property
    def now(self) -> Moment:
        """Return the newest true state."""
        return self.record.moments[-1]

    @property
    def emulator(self) -> Emulator:
        """Return the emulated vehicle."""
        return self.room.emulator

    def wait(self, condition: Callable[[], bool], limit_s: float, must: bool = True, what: str = "") -> bool:
        """Wait until a condition holds; raises FlightFailed after limit_s, unless it need not hold."""
        deadline = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > deadline:
                if must:
                    raise FlightFailed(f"{what or 'what the flight waits for'} did not come within {limit_s:g} s; "
                                       f"{self.last_words()}")  # fmt: skip
                return False
            time.sleep(0.01)
        return True

    def last_words(self) -> str:
        """Return the driver's last status and events as text."""
        status = self.newest(VEHICLE_STATUS)
        said = f"{status.flight_state}, {status.mode}: {status.detail}" if status else "no status"
        events = [one.message.text for one in self.record.heard(EVENT)[-3:]]
        return f"last status {said}; events: {'; '.join(events) or 'none'}"

    def newest(self, topic: Any) -> Any:
        """Return the newest message of a topic, or None."""
        heard = self.record.heard(topic)
        return heard[-1].message if heard else None

    @contextmanager
    def mark(self, name: str) -> Iterator[None]:
        """Name a span of time."""
        begin = time.monotonic_ns()
        yield
        self.record.marks[name] = (begin, time.monotonic_ns())

    def spend(self, name: str, seconds: float) -> None:
        """Let a named span of time pass."""
        with self.mark(name):
            time.sleep(seconds)

    def mode(self, *modes: str) -> bool:
        """Return whether the driver reports one of these modes."""
        status = self.newest(VEHICLE_STATUS)
        return status is not None and status.mode in modes

    def order(self, name: str, verb: Verb, limit_s: float = 5.0, **how: Any) -> str:
        """Give a command and wait for its first answer; returns the stage."""
        before = len(self.record.heard(COMMAND_ACK))
        made = self.up.order(name, verb, **how)
        answers: list[str] = []

        def answered() -> bool:
            heard = self.record.heard(COMMAND_ACK)[before:]
            answers[:] = [one.message.stage for one in heard if one.message.command_id == made.id]
            return any(stage != AckStage.RECEIVED for stage in answers)

        self.wait(answered, limit_s, must=False)
        return answers[-1] if answers else ""

    # -- common parts of scripts --------------------------------------------------------------------------------------

    def newest_after_start(self) -> bool:
        """Return whether the driver has sent a status since its last start."""
        heard = self.record.heard(VEHICLE_STATUS)
        return bool(heard) and heard[-1].at_ns > self.driver.started_ns

    def connect(self) -> None:
        """Start the driver and wait until it says that it is ready."""
        with self.mark("start"):
            self.start_driver()
            self.wait(self._is_ready, 30.0, what="READY on the ground")

    def _is_ready(self) -> bool:
        process, status = self.newest(PROCESS_STATUS), self.newest(VEHICLE_STATUS)
        return process is not None and process.state == "READY" and status is not None and status.mode == "LANDED"

    def take_off(self, name: str = "take off") -> None:
        """Take off; some vehicles need a while until they may."""
        deadline = time.monotonic() + 25.0
        while self.order(name, Verb.TAKEOFF) != AckStage.ACCEPTED:
            if time.monotonic() > deadline:
                raise FlightFailed(f"TAKEOFF was not accepted; {self.last_words()}")
            time.sleep(0.5)
        with self.mark("climb"):
            self.wait(lambda: self.mode("HOVER") and self.now.position[2] > 0.3, 15.0, what="HOVER in the air")
            self.wait(lambda: abs(self.now.velocity[2]) < 0.1 and self.now.position[2] > 0.4, 6.0, must=False)

    def track(self, name: str = "track") -> None:
        """Take off and let setpoints of zero velocity control it."""
        self.connect()
        self.take_off()
        self.spend("hover", 1.0)
        self.begin_tracking(name)

    def begin_tracking(self, name: str = "track", verb: Verb = Verb.TRACK) -> None:
        """Order TRACK, or RESUME, and wait until the driver is in TRACK."""
        self.order(name, verb)
        self.wait(lambda: self.mode("TRACK"), 2.0, what="TRACK")

    def fly(self, mark: str, velocity: Sequence[float], turn: float, seconds: float) -> None:
        """Fly a velocity [m/s; base_stabilized] and a turn [rad/s] for a while, then stand still."""
        x, y, z = velocity
        self.up.wanted = ((x, y, z), turn)
        self.spend(mark, seconds)
        self.up.wanted = ((0.0, 0.0, 0.0), 0.0)

    def await_landing(self, mark: str, limit_s: float = 20.0) -> None:
        """Wait until it stands with motors off, or until the time is over; the record keeps how long that took."""
        with self.mark(mark):
            begin = time.monotonic()
            landed = self.wait(lambda: self.now.on_ground and not self.now.motors, limit_s, must=False)
            self.record.facts[mark] = time.monotonic() - begin if landed else float("inf")

    def land(self, mark: str = "landing") -> None:
        """Order LAND, wait until it stands, and end the driver."""
        self.order(mark, Verb.LAND)
        self.await_landing(mark)
        time.sleep(0.5)
        self.end()

    def end(self) -> None:
        """Ask the driver of a standing vehicle to stop, and wait for that."""
        self.driver.send(signal.SIGTERM)
        self.await_exit(4.0)


def _open(stop: StopDatagrams) -> Any:
    if not stop.transport:
        return UdpSender()
    module, _, name = stop.transport.partition(":")
    return getattr(importlib.import_module(module), name)(stop.way, _GUARDIAN)

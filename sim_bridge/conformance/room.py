"""The emulated vehicle in its room, run in real time by a thread that records its true motion."""

import threading
import time
from collections.abc import Callable

from groundstation.process.priority import go_first
from groundstation.time_units import NS_PER_MS
from sim_bridge.conformance.record import Moment, Record
from sim_bridge.conformance.subject import NAME, stranger_to
from sim_bridge.conformance.wire import Wire
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.stage import Stage
from sim_bridge.tick_schedule import Clockwork
from sim_bridge.world.emulation import Emulator, emulation_of
from sim_bridge.world.world import World

_STOOD_NS = 60 * NS_PER_MS


class Room:
    """One vehicle at its sockets. Use it as a context; other threads call it through `do`."""

    def __init__(self, launch: LaunchSpec, record: Record) -> None:
        self.world = World(launch.site, launch.scenario, launch.seed)
        self.body = self.world.drones[NAME]
        emulation = emulation_of(launch.site.drones[NAME].kind)
        self.emulator: Emulator = emulation.open(NAME, self.body, self.world.onboard.get(NAME), launch)
        self._stage = Stage(self.world)
        self._stage.add(NAME, self.emulator, self.emulator.fileno())
        self._record = record
        self._wishes: list[Callable[[], None]] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._turn, name="room", daemon=True)
        address = launch.addresses[NAME]
        self.wire = Wire(address, stranger_to(address))

    def __enter__(self) -> "Room":
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        self._thread.join()
        self._stage.close()

    def do(self, wish: Callable[[], None]) -> None:
        """Call a function between two ticks, in the room's thread."""
        self._wishes.append(wish)

    def _turn(self) -> None:
        go_first()
        clock = Clockwork(time.monotonic_ns())
        last_ns = time.monotonic_ns()
        with self.wire:
            while not self._ended.is_set():
                deadline_ns = clock.next_deadline()
                time.sleep(max(0.0, (deadline_ns - time.monotonic_ns()) / 1e9))
                now_ns = time.monotonic_ns()
                if now_ns - last_ns > _STOOD_NS:
                    self._record.stood_ms = max(self._record.stood_ms, (now_ns - last_ns) / 1e6)
                last_ns = now_ns
                clock.begin(now_ns)
                while self._wishes:
                    self._wishes.pop(0)()
                self._stage.tick(clock.deadline_ns)
                self._note(now_ns)

    def _note(self, now_ns: int) -> None:
        one = self.body.airframe
        self._record.moments.append(
            Moment(
                now_ns,
                (one.x, one.y, one.z),
                (one.vx, one.vy, one.vz),
                (one.roll, one.pitch, one.yaw),
                not self.body.airborne,
                self.body.autopilot.motors_on,
                self.body.battery,
            )
        )

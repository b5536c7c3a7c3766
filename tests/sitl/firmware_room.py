"""Unmodified firmwares as drones of the mixed team, at message level and in step with it.

Cameras, target and the other drones are those of the study; drivers, tracker and firmwares are the real ones. The
firmwares' processes are stopped while the room computes, then run for 10 ms of their own time: a loaded machine makes
the flight slower.
"""

import json
import math
import random
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # for the helper modules of this folder
from firmware_seat import Seat  # noqa: E402

from groundstation.bus import clock  # noqa: E402
from groundstation.bus.messages import Verb  # noqa: E402
from groundstation.settings.load import load_field  # noqa: E402
from groundstation.settings.resolved import resolved_field  # noqa: E402
from sim_bridge.scenario import Scenario  # noqa: E402
from sim_bridge.study.runner import Study, StudyOptions  # noqa: E402
from sim_bridge.world.world import TICK_NS  # noqa: E402

MIXED_TEAM = HERE.parents[1] / "config" / "mixed-team.yaml"
FIRST_SYSTEM = 8
SLICE_NS, ESTIMATE_NS = 10_000_000, 20_000_000
READY_S, SILENT_S = 120.0, 20.0
# PX4's simulator disturbs its sensors by the same random numbers at each start: flights that begin at the same time
# after it are one sample. The seed decides how long after it they begin.
WAITS_AT_MOST_S = 8.0


class FirmwareStudy(Study):
    """The study on the firmwares' clock; blind: drones that nobody sees, and whose own cameras show nothing."""

    start_ns = 0
    blind: frozenset[str] = frozenset()

    @property
    def now_ns(self) -> int:
        return self.start_ns + self.world.ticks * TICK_NS

    def _send(self, arrival_ns: int, key: str, message: Any) -> None:
        if self.blind & {getattr(message, "observer", ""), getattr(message, "subject", "")}:
            return
        super()._send(arrival_ns, key, message)


class Room:
    """One flight. `slice` is 10 ms of it; `until` goes on until a condition holds; `close` ends the firmwares.

    flavours: firmware of each drone. alone_s: longest time that a firmware flew on while this process waited for the
    processor. Its clock is slower than real time, so that it experiences such a pause as short.
    """

    def __init__(self, flavours: Mapping[str, str], seed: int, folder: Path, speed: float = 0.5) -> None:
        self.alone_s = 0.0
        self.flying = False
        self.trace: list[dict[str, Any]] = []
        self._now_ns = self._next_estimate_ns = 0
        self._waits_s = 1.0 + random.Random(seed).uniform(0.0, WAITS_AT_MOST_S)
        self.seats: list[Seat] = []
        try:
            for system, (name, flavour) in enumerate(flavours.items(), FIRST_SYSTEM):
                self.seats.append(Seat(name, flavour, system, folder / name, speed))
            self._build(seed)
        except BaseException:
            for seat in self.seats:
                seat.firmware.end()
            raise

    def _build(self, seed: int) -> None:
        settings = [(seat.name, key, value) for seat in self.seats for key, value in seat.settings.items()]
        field = load_field(MIXED_TEAM, [f"drones.{name}.mavlink.{key}={json.dumps(v)}" for name, key, v in settings])
        options = StudyOptions(seed, take_off_s=math.inf)
        self.study = FirmwareStudy(resolved_field(field), Scenario(), options, real=[seat.name for seat in self.seats])
        self.study.mode = "HOVER"
        for seat in self.seats:
            seat.take_seat(self.study, field)

    @contextmanager
    def clocked(self) -> Iterator[None]:
        """Make all modules here read the firmwares' clock."""
        old, clock.now_ns = clock.now_ns, self.now_ns
        try:
            yield
        finally:
            clock.now_ns = old

    def now_ns(self) -> int:
        """Return the time of the room, or real time until every firmware has reported its own."""
        return self._now_ns or time.monotonic_ns()

    def slice(self) -> None:
        """Advance everything by 10 ms."""
        self._let_firmwares_run()
        for seat in self.seats:
            seat.follow_truth()
        if self.flying:
            for _ in range(SLICE_NS // TICK_NS):
                self.study.step()
        now_ns = self.now_ns()
        entities = tuple(self.study.tracker.estimates()) if now_ns >= self._next_estimate_ns else None
        if entities is not None:
            self._next_estimate_ns = now_ns + ESTIMATE_NS
        for seat in self.seats:
            if entities is not None:
                seat.tell(entities)
            seat.drive(now_ns)
        if self.flying and self.study.world.ticks % 20 == 0:
            self._note()

    def _note(self) -> None:
        believed = {one.name: one for one in self.study.tracker.estimates()}
        for seat in self.seats:
            row = seat.row(believed.get(seat.name), self.now_ns())
            self.trace.append({"t": self.study.world.time_s} | row)

    def _let_firmwares_run(self) -> None:
        if not self._now_ns:
            time.sleep(SLICE_NS / 1e9)
            if all(seat.heard_ns for seat in self.seats):
                self._now_ns = time.monotonic_ns()
                for seat in self.seats:
                    seat.zero_ns = self._now_ns - seat.heard_ns
            return
        self._now_ns += SLICE_NS
        deadline = time.monotonic() + SILENT_S
        running = [seat for seat in self.seats if seat.lags(self._now_ns)]
        for seat in running:
            seat.run()
        while running:
            assert time.monotonic() < deadline, "the firmware's clock stands still"
            time.sleep(0.0005)
            for seat in [one for one in running if not one.lags(self._now_ns)]:
                seat.stop()
                running.remove(seat)
                if self.flying:
                    self.alone_s = max(self.alone_s, seat.ahead_ns(self._now_ns) / 1e9)

    def until(self, condition: Any, limit_s: float, verb: Verb | None = None, mode: str = "") -> bool:
        """Advance time until a condition holds; returns whether it did in time.

        verb: commanded twice a second to the drones whose driver is in a mode.
        """
        end_ns = self.now_ns() + round(limit_s * 1e9)
        next_ns = 0
        while not condition():
            now_ns = self.now_ns()
            if now_ns > end_ns:
                return False
            if verb is not None and now_ns >= next_ns:
                next_ns = now_ns + 500_000_000
                for seat in (one for one in self.seats if one.mode == mode):
                    seat.order(verb, now_ns)
            self.slice()
        return True

    def get_ready(self) -> None:
        """Wait on the pads until every vehicle may take off."""
        ready = self.until(lambda: all(_is_ready(seat) for seat in self.seats), READY_S)
        assert ready, self.said()
        assert self._now_ns and all(s.puppet.poses for s in self.seats), "neither time nor true pose is heard"
        self.until(lambda: False, self._waits_s)

    def said(self) -> str:
        """Return the drivers' modes and states, for failure messages."""
        return "\n".join(
            f"{s.name} {s.mode}: {s.host.watchdog.vehicle.not_ready}; {s.process.texts[-6:]}" for s in self.seats
        )

    def close(self) -> None:
        """End drivers and firmwares."""
        for seat in self.seats:
            seat.close()


def _is_ready(seat: Seat) -> bool:
    return seat.mode == "LANDED" and not seat.host.watchdog.vehicle.not_ready

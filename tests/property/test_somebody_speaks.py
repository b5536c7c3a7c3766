"""A drone always has a sender, and never two that contradict each other, whatever dies, freezes or wakes when.

Driver, supervisor and guardian are modelled as loops around the rules that fly (`groundstation.supervisor.silence`),
with their real periods and limits; every pair of faults is enumerated over time.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations, product
from typing import NamedTuple

import pytest

from groundstation.process.heartbeat import SlotState
from groundstation.supervisor.silence import (
    DriverSigns,
    FailsafeCommand,
    Guard,
    SupervisorSigns,
    command_at,
    silent_since,
)

MS = 1_000_000
TICK_MS = 20
RUN_MS = 8_000
FOREVER = 10**9
LAND_AFTER_S = 3.0
FLY, HOVER, LAND = 0, 1, 2
RANK = {FailsafeCommand.HOVER: HOVER, FailsafeCommand.LAND: LAND}
WARM_UP_MS = 4_000  # time of the faults; a stamp of 0 means "never"


class Fate(NamedTuple):
    """The fate of a process: it dies, or it freezes and wakes after a while."""

    kind: str = "alive"
    at_ms: int = 0
    for_ms: int = FOREVER

    def runs(self, t_ms: int) -> bool:
        begun = self.kind != "alive" and t_ms >= WARM_UP_MS + self.at_ms
        return not begun or (self.kind == "frozen" and t_ms >= WARM_UP_MS + self.at_ms + self.for_ms)

    def dead(self, t_ms: int) -> bool:
        return self.kind == "dead" and t_ms >= WARM_UP_MS + self.at_ms


ALIVE = Fate()
ONSETS_MS = (0, 260, 700, 3_200)


def fates(*spans_ms: int) -> list[Fate]:
    """Return death, and freezes of these lengths, at each onset."""
    freezes = [Fate("frozen", at, span) for at, span in product(ONSETS_MS, spans_ms)]
    return [Fate("dead", at) for at in ONSETS_MS] + freezes


COARSE = fates(700, 4_000, FOREVER)
FINE = fates(340, 600, 700, 1_300, 4_000, FOREVER)


@dataclass
class World:
    """One drone, its driver, supervisor and guardian; `said` holds (time [ms], sender, message)."""

    supervisor: Fate
    driver: Fate
    guardian: Fate
    said: list[tuple[int, str, int]] = field(default_factory=list)
    interruptions: list[str] = field(default_factory=list)
    # The heartbeat block.
    state: SlotState = SlotState.READY
    beat: int = 0
    worked: bool = True
    ended: bool = False
    gone: bool = False
    since: int = 0
    supervisor_beat: int = 0
    guardian_beat: int = 0
    # State of the driver's process.
    last_turn: int = 0
    lands: bool = False
    hovers: bool = False
    up_at: int = 0
    noticed: dict[str, int] = field(default_factory=dict)
    # State of the supervisor's and the guardian's.
    supervisor_turn: int = 0
    supervisor_awake: int = 0
    guardian_turn: int = 0
    guardian_awake: int = 0
    guardian_killed: bool = False
    guardian_up_at: int = 0
    guard: Guard = field(default_factory=lambda: Guard(LAND_AFTER_S, 10.0))

    def run(self) -> "World":
        began = WARM_UP_MS - 240
        self.beat = self.last_turn = self.supervisor_beat = self.supervisor_turn = began
        self.guardian_beat = self.guardian_turn = began
        for t in range(began + TICK_MS, WARM_UP_MS + RUN_MS, TICK_MS):
            if self.driver.dead(t) and not self.gone and not self.up_at:
                self.gone = True
            if t % 40 == 0:
                self.turn_driver(t)
            if t % 60 == 0 and self.supervisor.runs(t):
                self.turn_supervisor(t)
            if t % 40 == 20:
                self.turn_guardian(t)
        return self

    def say(self, t: int, who: str, what: int) -> None:
        if who != "driver" and self.signs().driving and t - self.beat < 240:
            self.interruptions.append(f"{t} ms: {who} speaks beside the driver")
        self.said.append((t, who, what))

    def signs(self) -> DriverSigns:
        return DriverSigns(self.state, self.beat * MS, self.worked, self.ended, self.gone)

    def turn_driver(self, t: int) -> None:
        """Fly; hover, then land, if the supervisor is silent, as the watchdog does. A new driver lands the drone."""
        reborn = self.up_at > 0
        if self.gone or self.ended or (reborn and t < self.up_at) or not (reborn or self.driver.runs(t)):
            return
        if reborn and self.state is SlotState.STARTING:
            if self.supervisor.dead(t):
                self.state, self.ended, self.gone = SlotState.STOPPING, True, True  # it never had the drone's telemetry
                return
            self.state, self.worked, self.lands = SlotState.READY, True, True
        dead, frozen = self.lasted("dead", self.supervisor.dead(t), t), self.lasted("frozen", self.stale(t), t)
        self.hovers |= t - self.last_turn > 500 or frozen >= 1_000
        self.lands |= dead >= 1_000 or frozen >= 2_700
        self.last_turn = self.beat = t
        self.say(t, "driver", LAND if self.lands else HOVER if self.hovers or self.stale(t) else FLY)

    def stale(self, t: int) -> bool:
        return t - self.supervisor_beat >= 300

    def lasted(self, what: str, condition: bool, t: int) -> int:
        """Return for how long a driver has observed a condition; one that wakes up observes it late."""
        since = self.noticed.setdefault(what, t) if condition else self.noticed.pop(what, t)
        return t - since

    def turn_supervisor(self, t: int) -> None:
        """Send after 400 ms, kill after 800 ms, restart ended processes."""
        if t - self.supervisor_turn > 250:
            self.supervisor_awake = t
        self.supervisor_turn = self.supervisor_beat = t
        if self.gone:
            self.since = silent_since(self.signs(), self.since * MS, 0, 0, 0) // MS
            self.state, self.worked, self.ended, self.gone, self.beat = SlotState.STARTING, False, False, False, 0
            self.up_at, self.last_turn = t + 1_200, t + 1_200
        elif self.state is SlotState.READY:
            self.since = silent_since(self.signs(), self.since * MS, t * MS, self.supervisor_awake * MS, 400 * MS) // MS
            heard = self.signs().heard_silent_ns(t * MS, self.supervisor_awake * MS)
            self.gone |= self.since > 0 and heard >= 800 * MS
        self.speak(t, "supervisor", command_at(self.since, t, LAND_AFTER_S / MS))
        self.watch_guardian(t)

    def watch_guardian(self, t: int) -> None:
        silent = t - max(self.guardian_beat, self.supervisor_awake)
        fate_dead = self.guardian.dead(t) and not self.guardian_killed
        if fate_dead or (not self.guardian_killed and silent >= 800):
            self.guardian_killed, self.guardian_up_at = True, t + 400
            self.guard = Guard(LAND_AFTER_S, 10.0)

    def turn_guardian(self, t: int) -> None:
        runs = t >= self.guardian_up_at if self.guardian_killed else self.guardian.runs(t)
        if not runs:
            return
        if t - self.guardian_turn > 200:
            self.guardian_awake = t
        self.guardian_turn = self.guardian_beat = t
        supervisor = SupervisorSigns(self.supervisor_beat * MS, alive=not self.supervisor.dead(t))
        decision = self.guard.step(t * MS, self.signs(), self.since * MS, supervisor, self.guardian_awake * MS)
        self.since = decision.since_ns // MS
        self.speak(t, "guardian", decision.command)
        self.gone |= decision.kill

    def speak(self, t: int, who: str, word: FailsafeCommand) -> None:
        if word is not FailsafeCommand.NONE:
            self.say(t, who, RANK[word])


def worlds(faulty: int, choice: list[Fate]) -> Iterator[World]:
    """Yield every run in which that many of the three processes have one of these fates."""
    for chosen in combinations(("supervisor", "driver", "guardian"), faulty):
        for drawn in product(choice, repeat=faulty):
            of = dict(zip(chosen, drawn, strict=True))
            yield World(of.get("supervisor", ALIVE), of.get("driver", ALIVE), of.get("guardian", ALIVE))


def contradictions(world: World) -> list[str]:
    """Return where two send at once, or where LAND is withdrawn."""
    found, landing = list(world.interruptions), False
    for t, who, what in world.said:
        if landing and what < LAND:
            found.append(f"{t} ms: {who} takes LAND back")
        landing |= what == LAND
    return found


def last_onset_ms(world: World) -> int:
    return WARM_UP_MS + max(f.at_ms for f in (world.supervisor, world.driver, world.guardian) if f is not ALIVE)


def broken_promises(world: World) -> list[str]:
    """Return the missing actions: messages at least each 0.5 s, no motion 0.5 s and LAND 3.5 s after the faults."""
    found = []
    times = [t for t, _, _ in world.said]
    for before, after in zip(times, [*times[1:], WARM_UP_MS + RUN_MS], strict=True):
        if after - before > 500 and not world.ended:
            found.append(f"nobody speaks from {before} to {after} ms")
    after_ms = last_onset_ms(world)
    lost = any(f.kind != "alive" and f.for_ms == FOREVER for f in (world.supervisor, world.driver))
    if lost:
        found += [f"{t} ms: {who} flies on" for t, who, what in world.said if t > after_ms + 500 and what == FLY]
        if not any(what == LAND and t <= after_ms + 3_500 for t, _, what in world.said):
            found.append("no LAND in time")
    return found


def require_words(world: World) -> None:
    problems = broken_promises(world.run()) + contradictions(world)
    assert not problems, (problems[:5], world.supervisor, world.driver, world.guardian)


def test_without_faults_only_the_driver_speaks() -> None:
    (world,) = worlds(0, COARSE)
    assert {(who, what) for _, who, what in world.run().said} == {("driver", FLY)}


@pytest.mark.parametrize("faulty", [1, 2])
def test_somebody_speaks_with_any_two_processes_lost(faulty: int) -> None:
    for world in worlds(faulty, COARSE):
        require_words(world)


@pytest.mark.slow
def test_somebody_speaks_whenever_two_processes_fail_and_wake() -> None:
    for world in worlds(2, FINE):
        require_words(world)


def test_with_all_three_lost_nobody_contradicts_either() -> None:
    for world in worlds(3, COARSE[::2]):
        problems = contradictions(world.run())
        assert not problems, (problems[:5], world.supervisor, world.driver, world.guardian)

"""The record of one flight of the kit: true motion, messages, marked spans of time. Times are monotonic ns."""

import bisect
import itertools
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from groundstation.bus.api import Received
from groundstation.bus.topics import Topic
from groundstation.time_units import NS_PER_S

_BUSY = 1.0  # programs that want to run, for each core


@dataclass(frozen=True, slots=True)
class Moment:
    """The vehicle's true state [m, m/s, rad; world]; motors: they turn."""

    at_ns: int
    position: tuple[float, float, float]
    velocity: tuple[float, float, float]
    attitude: tuple[float, float, float]
    on_ground: bool
    motors: bool
    battery: float

    @property
    def speed(self) -> float:
        """Return the horizontal speed [m/s]."""
        return math.hypot(*self.velocity[:2])

    @property
    def forward_left(self) -> tuple[float, float]:
        """Return the horizontal velocity [m/s; base_stabilized]."""
        c, s = math.cos(self.attitude[2]), math.sin(self.attitude[2])
        vx, vy, _ = self.velocity
        return c * vx + s * vy, c * vy - s * vx


def turned(motion: Sequence[Moment]) -> float:
    """Return how far the heading turned over a motion [rad; counter-clockwise], whole turns counted."""
    pairs = itertools.pairwise(motion)
    return sum(math.remainder(later.attitude[2] - earlier.attitude[2], math.tau) for earlier, later in pairs)


@dataclass(frozen=True, slots=True)
class Heard:
    """One message of the driver and when it was received."""

    at_ns: int
    received: Received

    @property
    def message(self) -> Any:
        """Return the decoded message."""
        return self.received.message


@dataclass
class Record:
    """Everything about one flight.

    marks: begin and end of its spans; exits: exit codes of its driver processes; stood_ms: longest pause of the room;
    load: of the computer meanwhile, per core.
    """

    moments: list[Moment] = field(default_factory=list)
    messages: dict[str, list[Heard]] = field(default_factory=lambda: defaultdict(list))
    marks: dict[str, tuple[int, int]] = field(default_factory=dict)
    commands: dict[str, str] = field(default_factory=dict)
    exits: list[int | None] = field(default_factory=list)
    facts: dict[str, float] = field(default_factory=dict)
    stood_ms: float = 0.0
    load: float = 0.0
    failure: str = ""
    log: str = ""

    @property
    def burden(self) -> str:
        """Return, in brackets, whether the computer was too busy for a flight in real time."""
        if self.load <= _BUSY and not self.stood_ms:
            return f" (the computer was not too busy: load {self.load:.1f} per core)"
        paused = f", a pause of {self.stood_ms:.0f} ms" if self.stood_ms else ""
        return f" (the computer was too busy: load {self.load:.1f} per core{paused}; end other programs and repeat)"

    def span(self, mark: str) -> tuple[int, int]:
        """Return begin and end of a marked span; raises AssertionError if the flight did not reach it."""
        assert mark in self.marks, self.failure or f"the flight never came to: {mark}{self.burden}"
        return self.marks[mark]

    def motion(self, mark: str, skip_s: float = 0.0) -> list[Moment]:
        """Return the true states of a span, the first seconds left out; raises AssertionError for an empty span."""
        begin, end = self.span(mark)
        first, behind = self._index(begin), bisect.bisect_right(self.moments, end, key=lambda one: one.at_ns)
        assert first < behind, f"nothing was recorded of: {mark}{self.burden}"
        return self.moments[self._index(begin + round(skip_s * NS_PER_S)) : behind]

    def at(self, time_ns: int) -> Moment:
        """Return the true state at a time."""
        assert self.moments, "nothing was seen of the vehicle"
        return self.moments[min(self._index(time_ns), len(self.moments) - 1)]

    def _index(self, time_ns: int) -> int:
        return bisect.bisect_left(self.moments, time_ns, key=lambda one: one.at_ns)

    def heard(self, topic: Topic, mark: str = "") -> list[Heard]:
        """Return the messages of a topic, all or those received in a span."""
        everything = self.messages[topic.name]
        if not mark:
            return everything
        begin, end = self.span(mark)
        return [one for one in everything if begin <= one.at_ns <= end]

    def last(self, topic: Topic, mark: str) -> Any:
        """Return the last message of a topic in a span; raises AssertionError if there is none."""
        heard = self.heard(topic, mark)
        assert heard, f"no {topic.name} was received in: {mark}{self.burden}"
        return heard[-1].message

    def stages(self, command: str, topic: Topic) -> list[str]:
        """Return the stages of the answers to a command of this name, in order."""
        assert command in self.commands, self.failure or f"the flight never came to the order {command}"
        return [one.message.stage for one in self.heard(topic) if one.message.command_id == self.commands[command]]

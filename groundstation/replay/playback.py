"""The clock of a replay: its position, speed, and the jumps that pages request."""

from collections.abc import Iterator
from typing import Any

from groundstation.replay.arrival_order import Reel
from groundstation.replay.source import Source
from groundstation.time_units import NS_PER_MS

# Trails are kept at 5 Hz: a fast replay takes steps of this size, and loses no point of them.
_STRETCH_NS = 200 * NS_PER_MS
_LONGEST_TURN_S = 0.25


class Playback:
    """Keeps the time of a replay [UNIX ns inside; the run's boot clock towards pages, see console.player.Player].

    from_s: where it begins, after the start of the recording.
    """

    def __init__(self, source: Source, speed: float = 1.0, from_s: float = 0.0, playing: bool = True) -> None:
        self.source = source
        self.reel = Reel(source)
        self.speed = speed
        self.playing = playing
        self.at_ns = min(self.reel.end_ns, self.reel.start_ns + round(from_s * 1e9))
        self._sought = True

    @property
    def ended(self) -> bool:
        """Return whether the replay is at its end."""
        return self.at_ns >= self.reel.end_ns

    def boot_ns(self, unix_ns: int) -> int:
        """Return a time of the recording on the run's boot clock."""
        return unix_ns - self.source.unix_offset_ns

    def now_ns(self) -> int:
        """Return its position [boot clock]."""
        return self.boot_ns(self.at_ns)

    def section(self) -> dict[str, Any]:
        """Return its state for pages."""
        return {
            "at_ms": round(self.now_ns() / 1e6, 3),
            "playing": self.playing,
            "speed": self.speed,
            "ended": self.ended,
        }

    def play(self, playing: bool) -> None:
        """Play or pause; at the end, play from the start again."""
        if playing and self.ended:
            self._go(self.reel.start_ns)
        self.playing = playing

    def set_speed(self, factor: float) -> None:
        """Set the speed relative to real time."""
        self.speed = factor

    def seek(self, at_ns: int) -> None:
        """Go to a time of the boot clock, within the recording."""
        self._go(at_ns + self.source.unix_offset_ns)

    def step(self, ticks: int) -> None:
        """Go a number of the tracker's ticks forwards or back, and pause there."""
        self.playing = False
        at_ns = self.at_ns
        for _ in range(abs(ticks)):
            at_ns = self.reel.tick_after(at_ns) if ticks > 0 else self.reel.tick_before(at_ns)
        self._go(at_ns)

    def _go(self, at_ns: int) -> None:
        self.at_ns = max(self.reel.start_ns, min(self.reel.end_ns, at_ns))
        self._sought = True
        self.playing = self.playing and not self.ended

    def take_sought(self) -> bool:
        """Return and forget whether it has jumped since the last call."""
        sought, self._sought = self._sought, False
        return sought

    def advance(self, elapsed_s: float) -> Iterator[tuple[int, int]]:
        """Advance time; yields (after, until) in stretches, each when the one before has been shown."""
        if not self.playing:
            return
        # A missed turn is not made up for: no viewer would see it.
        goal_ns = min(self.reel.end_ns, self.at_ns + round(min(elapsed_s, _LONGEST_TURN_S) * self.speed * 1e9))
        while self.at_ns < goal_ns:
            after_ns, self.at_ns = self.at_ns, min(goal_ns, self.at_ns + _STRETCH_NS)
            yield after_ns, self.at_ns
        self.playing = not self.ended

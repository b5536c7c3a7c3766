"""The interface of a replay to the console (groundstation.replay.playback)."""

from typing import Any, Protocol


class Player(Protocol):
    """A replay that pages control together; all times are of the run's boot clock."""

    def now_ns(self) -> int:
        """Return its position."""

    def section(self) -> dict[str, Any]:
        """Return its state for pages."""

    def play(self, playing: bool) -> None:
        """Play or pause."""

    def set_speed(self, factor: float) -> None:
        """Set the speed relative to real time."""

    def seek(self, at_ns: int) -> None:
        """Go to a time."""

    def step(self, ticks: int) -> None:
        """Go a number of the tracker's ticks forwards or back, and pause there."""

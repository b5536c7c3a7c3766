"""What a console needs of whatever replays a recording into it (groundstation.replay.playback)."""

from typing import Any, Protocol


class Player(Protocol):
    """A replay that pages control together; all times are of the run's boot clock."""

    def now_ns(self) -> int:
        """Return how far it has come."""

    def section(self) -> dict[str, Any]:
        """Return what pages show of it."""

    def play(self, playing: bool) -> None:
        """Go on, or stop."""

    def set_speed(self, factor: float) -> None:
        """Go so many times as fast as it was."""

    def seek(self, at_ns: int) -> None:
        """Go to a time."""

    def step(self, ticks: int) -> None:
        """Go so many ticks of the tracker on or back, and stop there."""

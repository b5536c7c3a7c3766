"""What a tracker took in: the input of every calibration."""

from dataclasses import dataclass

from groundstation.bus.messages import Message


@dataclass(frozen=True, slots=True)
class Flown:
    """What a tracker took in: (now [ns], its messages with their keys) by tick, and the clock it read."""

    ticks: tuple[tuple[int, tuple[tuple[str, Message], ...]], ...]
    clock: str
    cameras: dict[str, int]

    @property
    def duration_s(self) -> float:
        """Return how long it is."""
        return (self.ticks[-1][0] - self.ticks[0][0]) / 1e9

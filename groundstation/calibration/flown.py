"""The tracker's recorded input messages: the input of every calibration."""

from collections import Counter
from dataclasses import dataclass

from groundstation.bus.messages import Message, RelativeObservation


@dataclass(frozen=True, slots=True)
class Flown:
    """The input messages of a tracker: (now [ns], messages with their keys) by tick, and the clock it read.

    off_pads: drones that may have left their pads before the first tick: where they stand is not known; doubts: what is
    damaged or missing in the recording.
    """

    ticks: tuple[tuple[int, tuple[tuple[str, Message], ...]], ...]
    clock: str
    off_pads: frozenset[str] = frozenset()
    doubts: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """Return the length of the flight [s]."""
        return (self.ticks[-1][0] - self.ticks[0][0]) / 1e9

    @property
    def cameras(self) -> Counter[str]:
        """Return the number of observations of each camera."""
        messages = (message for _, inputs in self.ticks for _, message in inputs)
        return Counter(message.camera for message in messages if isinstance(message, RelativeObservation))

"""The loop of a live view: a client of the bus that drops samples rather than delays them."""

import time
from collections.abc import Callable, Sequence
from typing import Protocol

from groundstation.bus import clock
from groundstation.bus.api import Bus, Sample, Subscription
from groundstation.bus.topics import IMU, JOURNAL, ODOMETRY
from groundstation.recording.file_topics import IMAGE_TOPICS, STATE_TOPICS

# Hundreds of samples a second cannot be seen; recordings have them.
_SHOWN = tuple(topic for topic in STATE_TOPICS if topic not in (IMU, ODOMETRY, JOURNAL))


class LiveView(Protocol):
    """A view that shows samples; PERIOD_S: time between two turns."""

    PERIOD_S: float = 0.05

    @property
    def alive(self) -> bool:
        """Return whether it can still show them."""

    def subscribe(self, bus: Bus) -> Sequence[Subscription]:
        """Return the queues of the topics that it shows: of all that a recording has, unless it says otherwise."""
        return bus.subscribe(_SHOWN, capacity=4096), bus.subscribe(IMAGE_TOPICS, capacity=64)

    def take(self, sample: Sample, now_ns: int) -> None:
        """Show a sample that arrived at a boot-clock time."""

    def close(self) -> None:
        """End the view, after sending remaining data."""


def watch(bus: Bus, view: LiveView, goes_on: Callable[[], bool]) -> int:
    """Show new messages until `goes_on` returns False or the view is gone; returns the number of dropped samples."""
    queues = view.subscribe(bus)
    while view.alive and goes_on():
        now_ns = clock.now_ns()
        for queue in queues:
            for sample in queue.drain_samples():
                view.take(sample, now_ns)
        time.sleep(view.PERIOD_S)
    return sum(queue.overflowed for queue in queues)

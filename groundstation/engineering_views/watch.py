"""The loop of a live view: a client of the bus like any other, that drops rather than delays."""

import time
from collections.abc import Callable, Sequence
from typing import Protocol

from groundstation.bus import clock
from groundstation.bus.api import Bus, Sample, Subscription
from groundstation.bus.topics import IMU, JOURNAL, ODOMETRY
from groundstation.recording.file_topics import IMAGE_TOPICS, STATE_TOPICS

USUAL_PERIOD_S = 0.05
# Nobody looks at hundreds of samples a second; recordings have them.
_SHOWN = tuple(topic for topic in STATE_TOPICS if topic not in (IMU, ODOMETRY, JOURNAL))


class LiveView(Protocol):
    """Something that shows samples; PERIOD_S: between two looks for new ones."""

    PERIOD_S: float

    @property
    def alive(self) -> bool:
        """Return whether it still can."""

    def subscribe(self, bus: Bus) -> Sequence[Subscription]:
        """Return the queues of what it shows."""

    def take(self, sample: Sample, now_ns: int) -> None:
        """Show a sample that arrived at a boot-clock time."""

    def close(self) -> None:
        """End it, handing over what is left."""


def everything(bus: Bus) -> tuple[Subscription, ...]:
    """Return the queues of all that a recording would show."""
    return bus.subscribe(_SHOWN, capacity=4096), bus.subscribe(IMAGE_TOPICS, capacity=64)


def watch(bus: Bus, view: LiveView, goes_on: Callable[[], bool]) -> int:
    """Show new messages until `goes_on` says no or the view is gone; returns how many samples were dropped."""
    queues = view.subscribe(bus)
    while view.alive and goes_on():
        now_ns = clock.now_ns()
        for queue in queues:
            for sample in queue.drain_samples():
                view.take(sample, now_ns)
        time.sleep(view.PERIOD_S)
    return sum(queue.overflowed for queue in queues)

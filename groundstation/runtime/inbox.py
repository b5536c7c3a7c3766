"""The messages that arrived for the tracker since the last tick: decoded, in order of arrival; refusals are counted."""

from collections import Counter

from groundstation.bus import codec, keys
from groundstation.bus.api import Bus
from groundstation.bus.messages import Message
from groundstation.bus.topics import (
    BODY_POSES,
    CLOCK,
    IMU,
    OBSERVATION,
    ODOMETRY,
    RANGE,
    REPORTED_MOTION,
    SEARCHED_PICTURE,
    SUSPICION,
    VEHICLE_STATUS,
)
from groundstation.errors import MessageError

_MEASURED = (ODOMETRY, IMU, OBSERVATION, RANGE, REPORTED_MOTION, SEARCHED_PICTURE, BODY_POSES)
TOPICS = (*_MEASURED, VEHICLE_STATUS, CLOCK, SUSPICION)
CAPACITY = 8192  # at 200 Hz odometry and IMU of ten drones: two seconds of a stalled loop
_MAX_PER_TICK = 4096


class Inbox:
    """Drains one bounded subscription; the network thread only enqueues into it.

    The order of arrival need not be the order of measurement: the filter restores that (estimation/fixed_lag.py).
    """

    def __init__(self, bus: Bus) -> None:
        self._subscription = bus.subscribe(TOPICS, capacity=CAPACITY)
        self.refused: Counter[str] = Counter()
        self._skipped = 0

    @property
    def overflowed(self) -> int:
        """Return how many messages were dropped because the loop did not drain in time."""
        return self._subscription.overflowed + self._skipped

    def pop_ready(self) -> list[tuple[str, Message]]:
        """Return (key, message) of all that arrived, in order; undecodable messages are counted by reason."""
        ready = []
        samples = self._subscription.drain_samples()
        self._skipped += max(0, len(samples) - _MAX_PER_TICK)
        for sample in samples[-_MAX_PER_TICK:]:
            try:
                ready.append((sample.key, codec.decode(keys.parse(sample.key), sample.payload)))
            except MessageError as error:
                self.refused[error.reason] += 1
        return ready

"""The interface of the bus: publishing, and subscriptions that never block the network."""

import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

from groundstation.bus import codec, keys
from groundstation.bus.keys import Key
from groundstation.bus.messages import Header, Message
from groundstation.bus.topics import Topic
from groundstation.errors import MessageError


@dataclass(frozen=True, slots=True)
class Sample:
    """Bytes received under a key, decoded later by the process's own loop.

    arrived_ns: arrival at the network, on this host's boot clock; 0 if not noted.
    """

    key: str
    payload: bytes
    attachment: bytes = b""
    arrived_ns: int = 0


@dataclass(frozen=True, slots=True)
class Received:
    """A decoded message (typed topics) or raw bytes with their header (`message` is None)."""

    key: Key
    header: Header
    message: Message | None
    payload: bytes
    arrived_ns: int = 0


def decode_sample(sample: Sample) -> Received:
    """Return the message of a sample; raises MessageError with the reason of a refusal."""
    key = keys.parse(sample.key)
    if key.topic.type is None:
        return Received(key, codec.decode_header(key, sample.attachment), None, sample.payload, sample.arrived_ns)
    message = codec.decode(key, sample.payload)
    return Received(key, message.header, message, sample.payload, sample.arrived_ns)


class Subscription:
    """A bounded queue between the network thread (which only enqueues) and the loop that drains it.

    With `newest=True` it keeps the newest sample per key instead. Overflows and refusals are counted. on_arrival:
    called by the network thread after each sample; it must not block. admits: judged by that thread before a sample is
    enqueued, where samples for others must not displace any; it must not raise.
    """

    def __init__(self, capacity: int = 4096, newest: bool = False) -> None:
        self._queue: deque[Sample] = deque(maxlen=capacity)
        self._newest: dict[str, Sample] | None = {} if newest else None
        self._arrived = threading.Event()
        self._lock = threading.Lock()
        self.on_arrival: Callable[[], None] | None = None
        self.admits: Callable[[Sample], bool] | None = None
        self.overflowed = 0
        self.refused: Counter[str] = Counter()

    def offer(self, sample: Sample) -> None:
        """Enqueue from any thread; drops and counts the oldest when full."""
        if self.admits is not None and not self.admits(sample):
            return
        with self._lock:
            if self._newest is not None:
                self._newest[sample.key] = sample
            else:
                self.overflowed += len(self._queue) == self._queue.maxlen
                self._queue.append(sample)
        self._arrived.set()
        if self.on_arrival is not None:
            self.on_arrival()

    @property
    def waiting(self) -> bool:
        """Return whether something arrived since the last drain."""
        return self._arrived.is_set()

    def drain_samples(self) -> list[Sample]:
        """Return and forget all waiting samples, undecoded."""
        if not self._arrived.is_set():  # usually so, and each turn of a driver checks five
            return []
        with self._lock:
            self._arrived.clear()
            if self._newest is not None:
                samples = list(self._newest.values())
                self._newest.clear()
            else:
                samples = list(self._queue)
                self._queue.clear()
        return samples

    def drain(self) -> list[Received]:
        """Return and forget all waiting messages; malformed ones are counted in `refused` by reason."""
        received = []
        for sample in self.drain_samples():
            try:
                received.append(decode_sample(sample))
            except MessageError as error:
                self.refused[error.reason] += 1
        return received

    def wait(self, timeout_s: float) -> bool:
        """Sleep until something arrives; returns False after the time-out."""
        return self._arrived.wait(timeout_s)


class Bus(Protocol):
    """One process's end of the star. `source` is the process's own name and goes into every key it publishes.

    run: name of the run that the process takes part in, "" if unknown.
    """

    site: str
    source: str
    run: str

    def header(self, entity: str, stamp_ns: int | None = None) -> Header:
        """Return a header of this process, stamped now unless a measurement time is given."""

    def publish(self, topic: Topic, message: Message) -> None:
        """Send a message under its header's entity; never blocks, never raises for a lost link."""

    def publish_bytes(self, topic: Topic, header: Header, payload: bytes) -> None:
        """Send raw bytes (pictures, datagrams) with their header as attachment."""

    def subscribe(
        self, topics: Iterable[Topic], entity: str = "*", source: str = "*", capacity: int = 4096, newest: bool = False
    ) -> Subscription:
        """Return one queue fed by all given topics of the given entity and source."""

    def close(self) -> None:
        """Leave the bus; idempotent."""

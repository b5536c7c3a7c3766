"""A bus inside one process, for tests and for tools that need no network."""

from collections.abc import Iterable
from fnmatch import fnmatchcase

from groundstation.bus import clock, keys
from groundstation.bus.api import Sample, Subscription
from groundstation.bus.sender import Sender
from groundstation.bus.topics import Topic


class MemoryExchange:
    """Connects the memory buses that share it."""

    def __init__(self) -> None:
        self._subscriptions: list[tuple[str, Subscription]] = []

    def attach(self, pattern: str, subscription: Subscription) -> None:
        """Deliver messages that match the key pattern to the subscription."""
        self._subscriptions.append((pattern, subscription))

    def deliver(self, sample: Sample) -> None:
        """Hand a sample to every matching subscription."""
        for pattern, subscription in self._subscriptions:
            if fnmatchcase(sample.key, pattern) and sample.key.count("/") == pattern.count("/"):
                subscription.offer(sample)


class MemoryBus(Sender):
    """A bus that delivers within this process, in the caller's thread."""

    def __init__(self, exchange: MemoryExchange, site: str, source: str, run: str = "") -> None:
        super().__init__(site, source, run)
        self._exchange = exchange

    def subscribe(
        self, topics: Iterable[Topic], entity: str = "*", source: str = "*", capacity: int = 4096, newest: bool = False
    ) -> Subscription:
        """Return one queue fed by all given topics of the given entity and source."""
        subscription = Subscription(capacity, newest)
        for topic in topics:
            self._exchange.attach(keys.expression(self.site, topic, entity, source), subscription)
        return subscription

    def put(self, topic: Topic, entity: str, payload: bytes, attachment: bytes) -> None:
        """Deliver to all matching subscriptions now."""
        self._exchange.deliver(Sample(self.key(topic, entity), payload, attachment, clock.own_ns()))

    def close(self) -> None:
        """Do nothing: there is nothing to release."""

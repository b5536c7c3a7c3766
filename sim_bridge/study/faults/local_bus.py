"""A bus inside one thread that passes message objects on without encoding them."""

from collections import deque
from collections.abc import Iterable

from groundstation.bus.api import Received, Sample, Subscription
from groundstation.bus.keys import Key
from groundstation.bus.messages import Header, Message
from groundstation.bus.sender import Sender
from groundstation.bus.topics import Topic


class LocalSubscription(Subscription):
    """Messages that a subscriber has not taken yet, not encoded."""

    def __init__(self, entity: str, newest: bool, capacity: int) -> None:
        super().__init__(capacity, newest)
        self.entity = entity
        self._kept: deque[Received] = deque(maxlen=capacity)
        self._latest: dict[tuple[str, str], Received] | None = {} if newest else None

    def put(self, received: Received) -> None:
        """Take a message."""
        if self._latest is None:
            self._kept.append(received)
        else:
            self._latest[received.key.entity, received.key.topic.name] = received

    def drain_samples(self) -> list[Sample]:
        """Return nothing: there are no bytes."""
        return []

    @property
    def waiting(self) -> bool:
        """Return whether messages came since the last drain."""
        return bool(self._kept or self._latest)

    def drain(self) -> list[Received]:
        """Return and forget the messages."""
        if self._latest is not None:
            found = list(self._latest.values())
            self._latest.clear()
        else:
            found = list(self._kept)
            self._kept.clear()
        return found


class LocalExchange:
    """Connects the buses that share it; messages without a subscriber are dropped."""

    def __init__(self) -> None:
        self._by_topic: dict[str, list[LocalSubscription]] = {}

    def attach(self, topic: Topic, subscription: LocalSubscription) -> None:
        """Deliver a topic to a subscription."""
        self._by_topic.setdefault(topic.name, []).append(subscription)

    def deliver(self, received: Received) -> None:
        """Hand a message to all its subscribers."""
        for subscription in self._by_topic.get(received.key.topic.name, ()):
            if subscription.entity in ("*", received.key.entity):
                subscription.put(received)


class LocalBus(Sender):
    """One process's end of the exchange."""

    def __init__(self, exchange: LocalExchange, site: str, source: str) -> None:
        super().__init__(site, source)
        self._exchange = exchange

    def publish(self, topic: Topic, message: Message) -> None:
        """Deliver now."""
        key = Key(self.site, message.header.entity, topic, self.source)
        self._exchange.deliver(Received(key, message.header, message, b""))

    def publish_bytes(self, topic: Topic, header: Header, payload: bytes) -> None:
        """Drop raw bytes: nobody records."""

    def subscribe(
        self, topics: Iterable[Topic], entity: str = "*", source: str = "*", capacity: int = 4096, newest: bool = False
    ) -> LocalSubscription:
        """Return one queue fed by all given topics of the given entity."""
        subscription = LocalSubscription(entity, newest, capacity)
        for topic in topics:
            self._exchange.attach(topic, subscription)
        return subscription

    def close(self) -> None:
        """Nothing to release."""

"""Subscriptions drop and count the oldest messages, keep the newest per key, and refuse malformed ones."""

from groundstation.bus import codec, topics
from groundstation.bus.api import Sample, Subscription
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Event, Severity


def event(bus: MemoryBus, text: str) -> Event:
    return Event(header=bus.header("drone_1"), severity=Severity.INFO, text=text)


def pair() -> tuple[MemoryBus, MemoryBus]:
    exchange = MemoryExchange()
    return MemoryBus(exchange, "lab", "sender"), MemoryBus(exchange, "lab", "receiver")


def test_messages_arrive_in_order_with_rising_sequence_numbers() -> None:
    sender, receiver = pair()
    subscription = receiver.subscribe([topics.EVENT])
    for text in "abc":
        sender.publish(topics.EVENT, event(sender, text))
    received = subscription.drain()
    assert [item.message.text for item in received if isinstance(item.message, Event)] == ["a", "b", "c"]
    assert [item.header.seq for item in received] == [0, 1, 2]
    assert subscription.drain() == []


def test_a_full_queue_drops_the_oldest_and_counts() -> None:
    sender, receiver = pair()
    subscription = receiver.subscribe([topics.EVENT], capacity=2)
    for text in "abc":
        sender.publish(topics.EVENT, event(sender, text))
    assert [item.header.seq for item in subscription.drain()] == [1, 2]
    assert subscription.overflowed == 1


def test_newest_keeps_one_sample_per_key() -> None:
    exchange = MemoryExchange()
    senders = [MemoryBus(exchange, "lab", name) for name in ("one", "two")]
    subscription = MemoryBus(exchange, "lab", "receiver").subscribe([topics.EVENT], newest=True)
    for text in "abc":
        for sender in senders:
            sender.publish(topics.EVENT, event(sender, text))
    assert sorted((item.key.source, item.header.seq) for item in subscription.drain()) == [("one", 2), ("two", 2)]


def test_refused_messages_are_counted_by_reason() -> None:
    subscription = Subscription()
    good_key = "gs/@v1/lab/drone_1/event/sender"
    subscription.offer(Sample(good_key, b"{"))
    subscription.offer(Sample("gs/@v1/*/x", b""))
    subscription.offer(Sample(good_key.replace("lab/", "lab/@sim/"), b"{}"))
    assert subscription.drain() == []
    assert dict(subscription.refused) == {"malformed": 1, "wildcard_key": 1, "unknown_topic": 1}


def test_raw_bytes_travel_with_their_header() -> None:
    sender, receiver = pair()
    subscription = receiver.subscribe([topics.IMAGE])
    header = sender.header("ceiling", 42)
    sender.publish_bytes(topics.IMAGE, header, b"\xff\xd8jpeg")
    (received,) = subscription.drain()
    assert received.payload == b"\xff\xd8jpeg"
    assert received.header == header
    assert received.message is None
    assert codec.decode_header(received.key, codec.encode(header)) == header


def test_a_subscription_to_one_entity_hears_no_other() -> None:
    sender, receiver = pair()
    subscription = receiver.subscribe([topics.EVENT], entity="drone_2")
    sender.publish(topics.EVENT, event(sender, "a"))
    assert subscription.drain() == []
    assert not subscription.wait(0.0)

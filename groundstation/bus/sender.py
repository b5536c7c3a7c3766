"""The half of a bus that only needs a way to put bytes: headers with sequence numbers, encoding."""

import itertools
from collections import defaultdict
from collections.abc import Iterator

from groundstation.bus import clock, codec, keys
from groundstation.bus.messages import Header, Message
from groundstation.bus.topics import Topic


class Sender:
    """Builds headers and keys for one source; subclasses implement `put`. run: the run that its orders are for."""

    def __init__(self, site: str, source: str, run: str = "") -> None:
        self.site = site
        self.source = source
        self.run = run
        self._sequence: defaultdict[str, Iterator[int]] = defaultdict(itertools.count)

    def header(self, entity: str, stamp_ns: int | None = None) -> Header:
        """Return a header of this process, stamped now unless a measurement time is given."""
        stamp = clock.now_ns() if stamp_ns is None else stamp_ns
        return Header(stamp, clock.clock_id(), entity, self.source, next(self._sequence[entity]))

    def publish(self, topic: Topic, message: Message) -> None:
        """Send a message under its header's entity."""
        self.put(topic, message.header.entity, codec.encode(message), b"")

    def publish_bytes(self, topic: Topic, header: Header, payload: bytes) -> None:
        """Send raw bytes with their header as attachment."""
        self.put(topic, header.entity, payload, codec.encode(header))

    def key(self, topic: Topic, entity: str) -> str:
        """Return the key this source publishes under."""
        return keys.expression(self.site, topic, entity, self.source)

    def put(self, topic: Topic, entity: str, payload: bytes, attachment: bytes) -> None:
        """Hand bytes to the transport."""
        raise NotImplementedError

"""A bus that keeps the messages published on it."""

from collections.abc import Callable

import pytest

from groundstation.bus.messages import Header, Message


class SentMessages:
    """The driver's end of a bus; `sent` holds its messages, numbered in their order."""

    def __init__(self) -> None:
        self.sent: list[Message] = []

    def header(self, entity: str, stamp_ns: int) -> Header:
        return Header(stamp_ns, "host", entity, entity, len(self.sent))

    def publish(self, _topic: object, message: Message) -> None:
        self.sent.append(message)


@pytest.fixture
def new_bus() -> Callable[[], SentMessages]:
    return SentMessages

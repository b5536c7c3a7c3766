"""What is on its way: things that arrive later than they were sent, in the order of their arrival."""

import heapq
import itertools
from collections.abc import Iterator
from typing import Generic, TypeVar

Item = TypeVar("Item")


class DelayQueue(Generic[Item]):
    """Holds things until they are due; of those that are due at one time, the first one sent comes first."""

    def __init__(self) -> None:
        self._waiting: list[tuple[int, int, Item]] = []
        self._order = itertools.count()

    def send(self, due_ns: int, item: Item) -> None:
        """Let something arrive at a time [ns]."""
        heapq.heappush(self._waiting, (due_ns, next(self._order), item))

    def due(self, now_ns: int) -> Iterator[Item]:
        """Take out, one by one, all that has arrived by now [ns]."""
        while self._waiting and self._waiting[0][0] <= now_ns:
            yield heapq.heappop(self._waiting)[2]

"""A queue of items that arrive later than they were sent, in the order of their arrival."""

import heapq
import itertools
from collections.abc import Iterator
from typing import Generic, TypeVar

Item = TypeVar("Item")


class DelayQueue(Generic[Item]):
    """Holds items until they are due; items due at the same time come in the order in which they were sent."""

    def __init__(self) -> None:
        self._waiting: list[tuple[int, int, Item]] = []
        self._order = itertools.count()

    def send(self, due_ns: int, item: Item) -> None:
        """Let an item arrive at a time [ns]."""
        heapq.heappush(self._waiting, (due_ns, next(self._order), item))

    def due(self, now_ns: int) -> Iterator[Item]:
        """Take out, one by one, the items that have arrived by now [ns]."""
        while self._waiting and self._waiting[0][0] <= now_ns:
            yield heapq.heappop(self._waiting)[2]

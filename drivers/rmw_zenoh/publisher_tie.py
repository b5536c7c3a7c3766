"""Accepts one publisher of a topic at a time. Pure."""

from groundstation.time_units import NS_PER_S


class PublisherTie:
    """Ties a topic to its first publisher, until that one is silent for heir_ns: its node was restarted."""

    def __init__(self, heir_ns: int = NS_PER_S) -> None:
        self._publisher, self._heard_ns, self._heir_ns = b"", 0, heir_ns

    def silent(self, now_ns: int) -> bool:
        """Return whether the publisher has been silent for so long, or always."""
        return not self._heard_ns or now_ns - self._heard_ns >= self._heir_ns

    def is_second(self, publisher: bytes, now_ns: int) -> bool:
        """Return whether this is not the publisher that the topic is tied to."""
        return publisher != self._publisher and not self.silent(now_ns)

    def is_other(self, publisher: bytes) -> bool:
        """Return whether the topic is tied to another publisher than this, speaking or not."""
        return self._heard_ns > 0 and publisher != self._publisher

    def take(self, publisher: bytes, now_ns: int) -> bool:
        """Tie the topic to a publisher that sent; returns whether it is another one than before."""
        changed = publisher != self._publisher
        self._publisher, self._heard_ns = publisher, now_ns
        return changed

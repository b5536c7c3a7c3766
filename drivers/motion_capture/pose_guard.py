"""Refuses poses of a ROS 2 topic that come from a second publisher, in another frame, or late. Pure."""

from dataclasses import dataclass, field

from drivers.plausibility.clock_watch import ClockWatch
from drivers.rmw_zenoh.publisher_tie import PublisherTie

_LATE_S = 0.3


@dataclass(slots=True)
class _Topic:
    """A body's frame and publisher, and that publisher's clock against ours."""

    frame: str
    tie: PublisherTie = field(default_factory=PublisherTie)
    clock: ClockWatch = field(default_factory=ClockWatch)


class PoseGuard:
    """Ties each body to its first publisher and frame, until they are silent for a second."""

    def __init__(self) -> None:
        self._topics: dict[str, _Topic] = {}

    def refusal(self, body: str, publisher: bytes, frame: str, stamp_ns: int, arrival_ns: int) -> str:
        """Return why a pose is not used, in words, or ""; stamp_ns: on the publisher's clock, 0 if it has none.

        Its lateness is judged against the freshest poses of the last 5 to 10 s: the publisher's clock may differ.
        """
        topic = self._topics.get(body)
        if topic is None or topic.tie.silent(arrival_ns):
            topic = self._topics[body] = _Topic(frame)
        if topic.tie.is_second(publisher, arrival_ns):
            return "second publisher"
        topic.tie.take(publisher, arrival_ns)
        if frame != topic.frame:
            return "another frame"
        if stamp_ns and topic.clock.update(arrival_ns, stamp_ns)[1] > _LATE_S:
            return "late"
        return ""

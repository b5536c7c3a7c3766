"""Which poses of a ROS 2 topic cannot be its own, or of now: of a second publisher, in another frame, late. Pure."""

from dataclasses import dataclass, field

from drivers.plausibility.clock_watch import ClockWatch
from groundstation.time_units import NS_PER_S

# A publisher that is silent for so long may be followed by another one: the node was started anew.
_HEIR_NS = NS_PER_S
_LATE_S = 0.3


@dataclass(slots=True)
class _Topic:
    """Who publishes a body's poses, in which frame, when it was heard last, and its clock against ours."""

    publisher: bytes
    frame: str
    heard_ns: int
    clock: ClockWatch = field(default_factory=ClockWatch)


class PoseGuard:
    """Ties each body to the publisher and the frame that it was heard with, until they are silent for a second."""

    def __init__(self) -> None:
        self._topics: dict[str, _Topic] = {}

    def refusal(self, body: str, publisher: bytes, frame: str, stamp_ns: int, arrival_ns: int) -> str:
        """Return why a pose is not used, in words, or ""; stamp_ns: on the publisher's clock, 0 where it has none.

        How late it is counts against the freshest poses of the last 5 to 10 s: the publisher's clock may differ.
        """
        topic = self._topics.get(body)
        if topic is None or arrival_ns - topic.heard_ns >= _HEIR_NS:
            topic = self._topics[body] = _Topic(publisher, frame, arrival_ns)
        if publisher != topic.publisher:
            return "second publisher"
        topic.heard_ns = arrival_ns
        if frame != topic.frame:
            return "another frame"
        if stamp_ns and topic.clock.update(arrival_ns, stamp_ns)[1] > _LATE_S:
            return "late"
        return ""

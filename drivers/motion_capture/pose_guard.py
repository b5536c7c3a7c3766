"""Refuses poses of a ROS 2 topic that come from a second publisher, in another frame, or late. Pure."""

from dataclasses import dataclass, field
from typing import NamedTuple

from drivers.plausibility.clock_watch import ClockWatch
from drivers.rmw_zenoh.publisher_tie import PublisherTie

# Later than the freshest ones by more than this, a pose is not used.
LATE_S = 0.3


class Judgement(NamedTuple):
    """Why a pose is not used, in words, or ""; and by how much it is later than the freshest ones [ns]."""

    refusal: str
    late_ns: int = 0


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

    def judge(self, body: str, publisher: bytes, frame: str, stamp_ns: int, arrival_ns: int) -> Judgement:
        """Return whether a pose is used; stamp_ns: on the publisher's clock, 0 if it has none.

        Its lateness is judged against the freshest poses of the same publisher, whose clock may differ, also across a
        silence: what waited during it may never catch up.
        """
        topic = self._topics.setdefault(body, _Topic(frame))
        if topic.tie.silent(arrival_ns):
            topic.frame = frame
        if topic.tie.is_second(publisher, arrival_ns):
            return Judgement("second publisher")
        if topic.tie.take(publisher, arrival_ns):
            topic.clock.reset()
        if frame != topic.frame:
            return Judgement("another frame")
        late_s = topic.clock.update(arrival_ns, stamp_ns)[1] if stamp_ns else 0.0
        return Judgement("late" if late_s > LATE_S else "", round(late_s * 1e9))

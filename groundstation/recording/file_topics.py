"""Which topics go into which file of a run."""

from groundstation.bus.topics import INNOVATION, LEASE, TOPICS, Quality, Topic
from groundstation.recording.schemas import is_picture

STATE = "state"
RAW = "raw"

# Typed messages are small and tell the whole story; pictures and datagrams are bulky and lie beside them.
STATE_TOPICS: tuple[Topic, ...] = tuple(topic for topic in TOPICS.values() if topic.type is not None)
IMAGE_TOPICS: tuple[Topic, ...] = tuple(topic for topic in TOPICS.values() if is_picture(topic))
DATAGRAM_TOPICS: tuple[Topic, ...] = tuple(
    topic for topic in TOPICS.values() if topic.type is None and topic not in IMAGE_TOPICS
)
# What holds until it is said anew: a cut, or a viewer that joins at any moment, needs the last of each.
LATCHED_TOPICS: frozenset[Topic] = frozenset(
    topic
    for topic in STATE_TOPICS
    if topic is LEASE or (topic.quality is Quality.STATE and topic.rate_hz > 0 and topic is not INNOVATION)
)

"""The file of a run for each topic. Cheap to import: a restarted recorder subscribes first."""

from groundstation.bus.topics import INNOVATION, LEASE, TOPICS, Quality, Topic

STATE = "state"
RAW = "raw"


def is_picture(topic: Topic) -> bool:
    """Return whether the raw bytes of a topic are pictures."""
    return topic.type is None and topic.encoding.startswith(("image/", "video/"))


# Typed messages are small and describe the whole run; pictures and datagrams are bulky and go to a separate file.
STATE_TOPICS: tuple[Topic, ...] = tuple(topic for topic in TOPICS.values() if topic.type is not None)
IMAGE_TOPICS: tuple[Topic, ...] = tuple(topic for topic in TOPICS.values() if is_picture(topic))
DATAGRAM_TOPICS: tuple[Topic, ...] = tuple(
    topic for topic in TOPICS.values() if topic.type is None and topic not in IMAGE_TOPICS
)
# Topics whose last message stays valid: a cut, or a viewer that joins at any time, needs the last of each.
LATCHED_TOPICS: frozenset[Topic] = frozenset(
    topic
    for topic in STATE_TOPICS
    if topic is LEASE or (topic.quality is Quality.STATE and topic.rate_hz > 0 and topic is not INNOVATION)
)

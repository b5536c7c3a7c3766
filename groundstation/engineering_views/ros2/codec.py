"""ROS 2 messages as CDR bytes, with the type hashes that rmw_zenoh puts into its keys."""

from typing import Any, NamedTuple

from rosbags.typesys import Stores, get_typestore

DISTRIBUTIONS = ("humble", "jazzy", "lyrical")
# WIRE (docs/reference/ros2.md 1): Humble's rmw_zenoh has no type hashes.
_NO_HASH = "TypeHashNotSupported"


class RosMessage(NamedTuple):
    """A message for one topic (absolute, with its leading slash), as CDR bytes."""

    topic: str
    type: str
    data: bytes


class Ros2Codec:
    """Encodes for one distribution (of DISTRIBUTIONS)."""

    def __init__(self, distribution: str = "jazzy") -> None:
        self._hashed = distribution != "humble"
        self.store = get_typestore(getattr(Stores, f"ROS2_{distribution.upper()}"))

    def make(self, kind: str, **fields: Any) -> Any:
        """Return a message object of a type, such as std_msgs/msg/String, from its fields."""
        return self.store.types[kind](**fields)

    def message(self, topic: str, kind: str, **fields: Any) -> RosMessage:
        """Return a message of a type from its fields."""
        return RosMessage(topic, kind, self.encode(kind, self.make(kind, **fields)))

    def encode(self, kind: str, content: Any) -> bytes:
        """Return the CDR bytes of a message object of a type."""
        return bytes(self.store.serialize_cdr(content, kind))

    def hash_of(self, kind: str) -> str:
        """Return the type hash of a type, or its placeholder."""
        return self.store.hash_rihs01(kind) if self._hashed else _NO_HASH

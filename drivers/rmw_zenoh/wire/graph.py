"""Keys, liveliness tokens and attachments of rmw_zenoh, by which ROS 2 nodes find and read each other over Zenoh.

WIRE: all of it is in docs/reference/ros2.md 1 and 2.
"""

import struct

_ADMIN_SPACE = "@ros2_lv"
_NODE, _PUBLISHER = "NN", "MP"
# reliable, volatile, keep the last 10; all else by default
_QOS = "::,10:,:,:,,"
_ENCLAVE = _NAMESPACE = "%"


def dds_type(kind: str) -> str:
    """Return the DDS name of a type: std_msgs/msg/String is std_msgs::msg::dds_::String_."""
    package, group, name = kind.split("/")
    return f"{package}::{group}::dds_::{name}_"


def topic_key(domain: int, topic: str, kind: str, type_hash: str) -> str:
    """Return the key under which a topic is published."""
    return f"{domain}/{topic.lstrip('/')}/{dds_type(kind)}/{type_hash}"


def heard_key(domain: int, topic: str, kind: str = "*") -> str:
    """Return the key expression of a topic with any type hash; kind "*": with any type."""
    return f"{domain}/{topic.strip('/')}/{kind if kind == '*' else dds_type(kind)}/*"


def node_token(domain: int, session: str, node: str) -> str:
    """Return the liveliness token of a node."""
    return f"{_ADMIN_SPACE}/{domain}/{session}/0/0/{_NODE}/{_ENCLAVE}/{_NAMESPACE}/{node}"


def publisher_token(domain: int, session: str, node: str, number: int, topic: str, kind: str, type_hash: str) -> str:
    """Return the liveliness token of a node's publisher of a topic; numbers of a session differ."""
    name = topic.replace("/", "%")
    entity = f"{_ADMIN_SPACE}/{domain}/{session}/0/{number}/{_PUBLISHER}/{_ENCLAVE}/{_NAMESPACE}/{node}"
    return f"{entity}/{name}/{dds_type(kind)}/{type_hash}/{_QOS}"


def publishers_key(domain: int, topic: str, kind: str) -> str:
    """Return the key expression of the tokens of all publishers of a topic."""
    return f"{_ADMIN_SPACE}/{domain}/*/*/*/{_PUBLISHER}/*/*/*/%{topic.strip('/').replace('/', '%')}/{dds_type(kind)}/**"


def node_of(token: str) -> str:
    """Return the full name of the node whose token this is, "" of any other text."""
    parts = token.split("/")
    if len(parts) < 9 or parts[0] != _ADMIN_SPACE:
        return ""
    namespace, name = parts[7].replace("%", "/").rstrip("/"), parts[8]
    return f"{namespace}/{name}"


def publisher_of(attached: bytes) -> bytes:
    """Return the 16 bytes that name the publisher of a message, or nothing if the message does not name it."""
    return attached[17:33] if len(attached) == 33 else b""


def attachment(sequence: int, stamp_ns: int, publisher: bytes) -> bytes:
    """Return the attachment of a message: its number, its Unix time and the 16 bytes of its publisher."""
    return struct.pack("<qqB", sequence, stamp_ns, len(publisher)) + publisher

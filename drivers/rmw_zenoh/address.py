"""The address of ROS 2's router: common to addresses of topics and to sections of a field file."""

import re

NAME = r"[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*"
"""The pattern of a topic's or a namespace's name, without a leading slash."""

# WIRE (docs/reference/ros2.md 2): where the router listens. DDS has ports for this many domains.
ROUTER_PORT, LAST_DOMAIN = 7447, 232


def domain_of(query: str) -> int:
    """Return the domain that the query of an address names, 0 without one; raises ValueError for any other query."""
    name, _, value = (query or "domain=0").partition("=")
    if name != "domain" or not value.isdecimal() or int(value) > LAST_DOMAIN:
        raise ValueError(f"behind ? there may be domain=0 to {LAST_DOMAIN}, and nothing else")
    return int(value)


def topic_of(path: str) -> str:
    """Return the name of the topic, or of their common prefix, in the path of an address, without its leading slash.

    "" for an empty path. Raises ValueError for any other name: it would be no key, or one of many topics.
    """
    topic = path.removeprefix("/").removesuffix("/")
    if topic and not re.fullmatch(NAME, topic):
        raise ValueError(f"the topic /{topic} is no name of ROS 2: letters, digits and _ between single slashes")
    return topic

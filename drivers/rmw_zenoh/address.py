"""The address of ROS 2's router: common to addresses of topics and to sections of a field file."""

# WIRE (docs/reference/ros2.md 2): where the router listens. DDS has ports for this many domains.
ROUTER_PORT, LAST_DOMAIN = 7447, 232


def domain_of(query: str) -> int:
    """Return the domain that the query of an address names, 0 without one; raises ValueError for any other query."""
    name, _, value = (query or "domain=0").partition("=")
    if name != "domain" or not value.isdecimal() or int(value) > LAST_DOMAIN:
        raise ValueError(f"behind ? there may be domain=0 to {LAST_DOMAIN}, and nothing else")
    return int(value)

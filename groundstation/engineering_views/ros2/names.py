"""Names of Skein's own topics: under /skein, where no robot's or camera's node publishes.

A robot's own node publishes /drone_1/odom: an estimate of ours there would be taken for the robot's, by our own driver
as by others.
"""


def own(name: str) -> str:
    """Return a topic's name within our namespace."""
    return f"/skein/{name}"

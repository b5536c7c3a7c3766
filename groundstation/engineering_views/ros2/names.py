"""Names of the topics that are Skein's own: under /skein, where no robot's or camera's node publishes.

A robot's own node says /drone_1/odom: an estimate of ours beside it would be taken for the robot's, by our own driver
as by others.
"""


def own(name: str) -> str:
    """Return a topic's name within our namespace."""
    return f"/skein/{name}"

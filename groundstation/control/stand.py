"""A place where a robot is to be, and where it is to look."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Stand:
    """A place [m; world], a heading [rad; world] and how fast the heading itself turns [rad/s]."""

    x: float
    y: float
    yaw: float
    yaw_rate: float = 0.0
